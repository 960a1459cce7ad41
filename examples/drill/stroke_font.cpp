// SPDX-License-Identifier: MIT
#include "stroke_font.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace drill {
namespace {

/// Strokes are separated by blanks; each point is two characters, x then y, where y = a, b means -1, -2.
constexpr std::array<std::string_view, 128> make_table() {
  std::array<std::string_view, 128> t{};
  t['a'] = "4435150401103041 4540", t['b'] = "0800 0415354441301001", t['c'] = "4435150401103041";
  t['d'] = "4435150401103041 4840", t['e'] = "03434435150401103041", t['f'] = "38281710 0535";
  t['g'] = "4435150401103041 454a3b1b0a", t['h'] = "0800 0415354440", t['i'] = "0500 07", t['j'] = "151a0b 17";
  t['k'] = "0800 4502 1340", t['l'] = "0800", t['m'] = "0500 0415253430 3445556460", t['n'] = "0500 0415354440";
  t['o'] = "150401103041443515", t['p'] = "050b 0415354441301001", t['q'] = "454b 4435150401103041";
  t['r'] = "0500 041535", t['s'] = "44351504133241301001", t['t'] = "17112030 0535", t['u'] = "0501103041 4540";
  t['v'] = "052045", t['w'] = "0510345065", t['x'] = "0540 4500", t['y'] = "0520 451b", t['z'] = "05450040";

  t['A'] = "003860 1353", t['B'] = "00083847453404 3453514000", t['C'] = "5748180701104051", t['D'] = "00083856523000";
  t['E'] = "58080050 0444", t['F'] = "580800 0444", t['G'] = "57481807011040515434", t['H'] = "0008 5058 0454";
  t['I'] = "0008", t['J'] = "4841301001", t['K'] = "0008 5803 2550", t['L'] = "080050", t['M'] = "0008336860";
  t['N'] = "00085058", t['O'] = "180701104051574818", t['P'] = "00084857554404", t['Q'] = "180701104051574818 3250";
  t['R'] = "00084857554404 3450", t['S'] = "574818070514445351401001", t['T'] = "0868 3830", t['U'] = "080110405158";
  t['V'] = "083068", t['W'] = "0820466088", t['X'] = "0850 5800", t['Y'] = "083468 3430", t['Z'] = "08580050";

  t['0'] = "180701103041473818", t['1'] = "062820", t['2'] = "07183847450040";
  t['3'] = "07183847453414 344341301001", t['4'] = "30380242", t['5'] = "480805354441301001";
  t['6'] = "473818070110304143341403", t['7'] = "084810", t['8'] = "14050718384745341403011030414334";
  t['9'] = "453414050718384741301001";

  t['.'] = "00", t[','] = "000a", t[':'] = "00 04", t[';'] = "000a 04", t['-'] = "0333", t['('] = "1806011a",
  t[')'] = "0816110a";
  t['/'] = "0048", t['='] = "0242 0444", t['+'] = "0343 2521", t['%'] = "0048 0708 4041", t['\''] = "0806",
  t['*'] = "03";
  return t;
}

constexpr auto kGlyphs = make_table();

std::string_view code(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u < kGlyphs.size() ? kGlyphs[u] : std::string_view{};
}

float y_of(char c) { return static_cast<float>(c >= 'a' ? 'a' - 1 - c : c - '0'); }

}  // namespace

std::vector<Stroke> glyph(char c) {
  std::vector<Stroke> strokes(1);
  const std::string_view s = code(c);
  for (std::size_t i = 0; i + 1 < s.size();) {
    if (s[i] == ' ') {
      strokes.emplace_back();
      ++i;
      continue;
    }
    strokes.back().push_back({static_cast<float>(s[i] - '0'), y_of(s[i + 1])});
    i += 2;
  }
  return strokes;
}

float glyph_advance(char c) {
  if (c == ' ') return 3.5F;
  float widest = 0;
  for (const Stroke& stroke : glyph(c))
    for (const auto& p : stroke) widest = std::max(widest, p.x());
  return widest + 2;
}

}  // namespace drill
