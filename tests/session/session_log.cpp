// SPDX-License-Identifier: MIT
// Logs of sessions: what is written comes back, and damaged files are read up to the damage or refused.
#include "logged.hpp"
#include "script.hpp"

#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/session/recorder.hpp>

#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <limits>
#include <mutex>
#include <random>
#include <stdexcept>
#include <thread>

namespace {

using namespace trephine;
using test::near;
using test::numbered;
using test::SessionFile;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

bool same(const RecordedTick& a, const RecordedTick& b) {
  bool equal = same_bits(a.result, b.result) && same_bits(a.dt, b.dt) && a.input.spindle_on == b.input.spindle_on;
  for (int e = 0; e < 16; ++e) equal = equal && same_bits(a.input.X_WT.matrix()(e), b.input.X_WT.matrix()(e));
  return equal;
}

/// A tick of random bits wherever a number may have any.
RecordedTick any_tick(std::mt19937_64& random) {
  const auto number = [&] { return std::bit_cast<double>(random()); };
  RecordedTick t;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 3; ++r) t.input.X_WT.matrix()(r, c) = number();
  t.input.spindle_on = random() % 2 == 0;
  t.dt = number();
  for (Vec3d* v : {&t.result.wrench.force, &t.result.wrench.torque, &t.result.structures.push.force,
                   &t.result.structures.push.torque})
    *v = Vec3d(number(), number(), number());
  t.result.contact = {
      .count = static_cast<int>(random()), .tip = random() % 2 == 0, .shaft = random() % 2 == 0, .depth = number()};
  t.result.removed_mm3 = number();
  t.result.status = static_cast<Status>(random() % 7);
  t.result.structures.nearest = static_cast<int>(random());
  t.result.structures.distance = number();
  t.result.structures.refused_mm3 = number();
  t.result.structures.taken_mm3 = number();
  t.result.structures.warns = random() % 2 == 0;
  t.result.cutting = {.thrust = number(), .torque = number(), .spindle = number(), .feed = number()};
  return t;
}

std::string logged(int ticks, const SessionLogOptions& options = {}) {
  std::string bytes;
  SessionLog log(test::MemorySink{bytes}, options);
  for (int i = 0; i < ticks; ++i) log(numbered(i));
  log.close();
  return bytes;
}

TEST_CASE("session log: gives back ticks bit for bit, tools and events in their places") {
  const SessionFile file("trephine_session_log.bin");
  std::mt19937_64 random(7);
  std::vector<RecordedTick> ticks;
  for (int i = 0; i < 3000; ++i) ticks.push_back(i % 10 == 0 ? any_tick(random) : numbered(i));
  {
    SessionLog log(file.path);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      if (i == 100) CHECK(log.tool_changed(5) == RecordStatus::kOk);
      if (i == 200) CHECK(log.event(std::numeric_limits<std::int64_t>::min()) == RecordStatus::kOk);
      if (i == 2000) CHECK(log.tool_changed(-1) == RecordStatus::kOk);
      CHECK(log.record(ticks[i].input, ticks[i].dt, ticks[i].result) == RecordStatus::kOk);
    }
    log.event(42);
  }  // as good as close()
  const Session session = load_session(file.path);
  CHECK(session.report.complete);
  CHECK(session.report.lost_bytes == 0);
  CHECK(session.report.dropped.count == 0);
  CHECK(session.report.ticks == 3000);
  CHECK(session.report.text() == "3000 ticks");
  REQUIRE(session.ticks.size() == ticks.size());
  std::size_t equal = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) equal += same(ticks[i], session.ticks[i]);
  CHECK(equal == ticks.size());
  REQUIRE(session.tools.size() == 2);
  CHECK(session.tools[0].position == 100);
  CHECK(session.tools[0].number == 5);
  CHECK(session.tools[1].position == 2000);
  CHECK(session.tools[1].number == -1);
  REQUIRE(session.events.size() == 2);
  CHECK(session.events[0].position == 200);
  CHECK(session.events[0].number == std::numeric_limits<std::int64_t>::min());
  CHECK(session.events[1].position == 3000);
  CHECK(session.events[1].number == 42);
}

TEST_CASE("session log: the guess of a rotation's third column is the cross product, and integers alone make it") {
  namespace detail = session_detail;
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> angle(-3, 3);
  double worst = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Mat3d R = rotation_from_vector<double>(Vec3d(angle(random), angle(random), angle(random)));
    detail::TickWords now{};
    for (int e = 0; e < 6; ++e) now[static_cast<std::size_t>(e)] = bits(R(e % 3, e / 3));
    const Vec3d cross = R.col(0).cross(R.col(1));
    for (int e = 0; e < 3; ++e) {
      const auto guess = std::bit_cast<double>(detail::guessed_word(now, {}, static_cast<std::size_t>(6 + e)));
      worst = std::max(worst, std::abs(guess - cross[e]));
    }
  }
  CHECK(worst <= 4e-16);  // a few roundings of numbers up to 1
  // Whatever is no part of a rotation leaves the tick before.
  detail::TickWords before{};
  before[6] = before[7] = before[8] = 77;
  for (const double odd :
       {2.0, -1e300, std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity()})
    for (std::size_t w = 0; w < 6; ++w) {
      detail::TickWords now{};
      now[w] = bits(odd);
      int left = 0;
      for (std::size_t third = 6; third < 9; ++third) left += detail::guessed_word(now, before, third) == 77;
      CHECK(left == 2);  // each number enters two of the three
    }
  static_assert(detail::double_bits(std::int64_t{1} << 60) == 0x3ff0'0000'0000'0000);
  static_assert(detail::double_bits(-(std::int64_t{3} << 59)) == 0xbff8'0000'0000'0000);
  static_assert(detail::fixed_point(0x3ff8'0000'0000'0000) == std::int64_t{3} << 60);
  static_assert(detail::fixed_point(0) == 0 && detail::fixed_point(1) == 0);
}

TEST_CASE("session log: an hour of drilling with a hand that trembles takes less than 500 MB") {
  // Numbers change in most of their digits, without pause: none of them, those of a pose and a contact, or all.
  enum class Noise { kNone, kContact, kAll };
  const auto megabytes_of = [](Noise kind) {
    constexpr int kTicks = 20000;
    constexpr double kTicksAnHour = 3.6e6;
    std::mt19937_64 random(9);
    std::normal_distribution<double> noise;
    const auto about = [&](double mean, double size) { return mean + size * noise(random); };
    const auto any = [&](double size) {
      return Vec3d(size * noise(random), size * noise(random), size * noise(random));
    };
    std::string bytes;
    SessionLog log(test::MemorySink{bytes}, {.records = std::size_t{1} << 15});
    for (int i = 0; i < kTicks; ++i) {
      const double t = 1e-3 * i;
      RecordedTick tick = numbered(1);
      TickResult& r = tick.result;
      if (kind != Noise::kNone) {
        tick.dt = about(1e-3, 1e-6);
        tick.input.X_WT =
            make_pose<double>(rotation_from_vector<double>(Vec3d(0.3 * std::sin(t), 0.2, 0.1 * t) + any(2e-5)),
                              Vec3d(0.02 + 0.01 * std::sin(6 * t), 0.02, 0.01) + any(2e-6));
        r.wrench = {Vec3d(1, 0.5, 2) + any(0.01), Vec3d(1e-3, 2e-3, 3e-3) + any(1e-5)};
        r.contact.depth = about(1e-4, 1e-6);
        r.removed_mm3 = 0.064 * static_cast<double>(random() % 5);
        test::near_structure(tick, 1, about(3e-3, 2e-6));
      }
      if (kind == Noise::kAll) {
        r.structures.push = {Vec3d(0.1, 0.2, 0.3) + any(0.01), Vec3d(1e-3, 2e-3, 3e-3) + any(1e-5)};
        r.structures.refused_mm3 = about(0.1, 1e-3);
        r.structures.taken_mm3 = about(0.1, 1e-3);
        r.removed_mm3 = about(0.064, 1e-3);
        r.cutting = {about(5, 0.1), about(1e-3, 1e-5), about(100, 1), about(1e-3, 1e-5)};
      }
      log(tick);
    }
    log.close();
    REQUIRE(log.dropped() == 0);
    return 1e-6 * static_cast<double>(bytes.size()) / kTicks * kTicksAnHour;
  };
  const double rest = megabytes_of(Noise::kNone), contact = megabytes_of(Noise::kContact);
  const double all = megabytes_of(Noise::kAll);
  CHECK(rest <= 30);
  CHECK(contact <= 450);
  CHECK(all <= 700);  // 33 random numbers of some 46 bits each
  MESSAGE("an hour at 1 kHz at rest, with noise on pose and contact, with noise on all [MB]: ", rest, " ", contact, " ",
          all);
}

TEST_CASE("session log: scores from the file have the bits of the live ones") {
  std::vector<RecordedTick> ticks;
  test::append(ticks, 5, [](double t, RecordedTick& tick) {
    test::place(tick, 5e-3 * std::sin(9 * t), 1e-3 * t);
    tick.result.wrench.force = Vec3d(0, std::sin(3 * t), 1.0 / 3.0);
    tick.result.removed_mm3 = 1e-3 * (1 + std::sin(t));
    test::near_structure(tick, 1, 2e-3 * std::cos(t));
  });
  const SessionFile file("trephine_session_scores.bin");
  const ScoreOptions options{.force_limit = 0.5};
  Scores live(options), later(options);
  SessionLog log(file.path);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (i == 2500) {
      live.tool_changed(2);
      log.tool_changed(2);
    }
    live(ticks[i]);
    log(ticks[i]);
  }
  log.close();
  CHECK(visit_session(file.path, later).complete);
  CHECK(live.totals().strokes > 10);
  CHECK(test::bits_of(later) == test::bits_of(live));
  CHECK(later.tools()[2].time == near(2.5));
}

TEST_CASE("session log: recordings load as sessions") {
  const SessionFile file("trephine_session_recording.bin");
  std::vector<RecordedTick> ticks = {numbered(1), numbered(2), numbered(3)};
  save_recording(file.path, ticks);
  const Session session = load_session(file.path);
  REQUIRE(session.ticks.size() == 3);
  CHECK(same(session.ticks[2], ticks[2]));
  CHECK(session.report.complete);
  CHECK(session.report.ticks == 3);
  // And those of older versions, which end a tick before the structures or the cutting.
  const std::string now = file.bytes();
  for (const std::uint32_t version : {1U, 2U}) {
    const std::size_t bytes = recording_detail::tick_bytes_of(version);
    std::string old = now.substr(0, 32);
    for (std::size_t i = 0; i < 3; ++i) old += now.substr(32 + 288 * i, bytes);
    old[12] = static_cast<char>(version);
    old[16] = static_cast<char>(bytes & 255);
    old[17] = static_cast<char>(bytes >> 8);
    append_number(old, recording_detail::fnv1a(old));
    const Session older = file.load_of(old);
    REQUIRE(older.ticks.size() == 3);
    CHECK(same(older.ticks[1], ticks[1]));
  }
  std::string damaged = now;
  damaged[50] = static_cast<char>(damaged[50] ^ 1);
  CHECK(contains(file.complaint(damaged), "is damaged"));
}

TEST_CASE("session log: a file that ends anywhere is read up to its last whole chunk, and the rest is told") {
  const SessionFile file("trephine_session_cut.bin");
  const std::string good = logged(2000);
  REQUIRE(file.load_of(good).ticks.size() == 2000);
  std::size_t before = 0, fewest = 2000;
  for (std::size_t keep = session_detail::kLogHeadBytes; keep < good.size(); keep += 1 + good.size() / 97) {
    CAPTURE(keep);
    const Session session = file.load_of(good.substr(0, keep));
    CHECK_FALSE(session.report.complete);
    CHECK(session.ticks.size() >= before);
    before = session.ticks.size();
    fewest = std::min(fewest, before);
    // What was read and what was lost are the whole file.
    CHECK(session.report.lost_bytes <= keep - session_detail::kLogHeadBytes);
    CHECK(contains(session.report.text(), "was not closed"));
    for (std::size_t i = 0; i < session.ticks.size(); ++i)
      if (session.ticks[i].result.contact.count != static_cast<int>(i)) FAIL("tick " << i << " is another");
  }
  CHECK(fewest == 0);
  CHECK(before > 500);
  // A byte less than all: the last chunk is lost, and nothing else.
  const Session almost = file.load_of(good.substr(0, good.size() - 1));
  CHECK(almost.report.lost_bytes > 0);
  CHECK(contains(almost.report.text(), std::to_string(almost.report.lost_bytes) + " bytes at the end"));
  // More than all.
  const Session more = file.load_of(good + "abc");
  CHECK(more.ticks.size() == 2000);
  CHECK(more.report.complete);
  CHECK(more.report.lost_bytes == 3);
}

TEST_CASE("session log: bytes that are damaged anywhere are found, and what is read is as it was written") {
  const SessionFile file("trephine_session_damaged.bin");
  const std::string good = logged(1200);
  std::mt19937_64 random(11);
  int refused = 0, cut = 0;
  for (int trial = 0; trial < 400; ++trial) {
    CAPTURE(trial);
    std::string bytes = good;
    const std::size_t at = trial < 40 ? static_cast<std::size_t>(trial) : random() % bytes.size();
    bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1 + random() % 255));
    file.write(bytes);
    try {
      const Session session = load_session(file.path);
      CHECK(at >= session_detail::kLogHeadBytes);
      CHECK_FALSE(session.report.complete);
      CHECK(session.report.lost_bytes > 0);
      for (std::size_t i = 0; i < session.ticks.size(); ++i)
        if (!same(session.ticks[i], numbered(static_cast<int>(i)))) FAIL("tick " << i << " is another");
      ++cut;
    } catch (const std::runtime_error& e) {
      CHECK(at < session_detail::kLogHeadBytes);
      CHECK(contains(e.what(), "trephine::visit_session: "));
      ++refused;
    }
  }
  CHECK(refused >= 32);
  CHECK(cut >= 300);
}

/// The head of a file of an older version.
std::string head_of(std::uint32_t version) {
  std::string bytes = session_detail::log_head().substr(0, 12);
  append_number(bytes, version);
  bytes += session_detail::log_head().substr(16, 8);
  append_number(bytes, recording_detail::fnv1a(bytes));
  return bytes;
}
/// A file with one chunk of these records, whose hashes are right.
std::string forged(const std::string& records, std::uint32_t version = session_detail::kLogVersion) {
  std::string bytes = head_of(version), chunk(session_detail::kChunkMark);
  append_number(chunk, static_cast<std::uint32_t>(records.size()));
  append_number(chunk, std::uint64_t{0});
  chunk += records;
  append_number(chunk, recording_detail::fnv1a(chunk));
  return bytes + chunk;
}

TEST_CASE("session log: a file of version 1 loads") {
  // Its ticks have words of 16 digits here, whatever they need: differences from the tick before, sign lowest.
  std::mt19937_64 random(13);
  std::vector<RecordedTick> ticks;
  for (int i = 0; i < 50; ++i) ticks.push_back(i % 5 == 0 ? any_tick(random) : numbered(i));
  std::string records;
  session_detail::TickWords before{}, now{};
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (i == 20) records += "\x02" + std::string("\x07") + std::string(7, '\x00');
    records += "\x01" + std::string(session_detail::kTickWords / 2, '\xff');
    std::string bytes;
    recording_detail::put_tick(bytes, ticks[i]);
    std::memcpy(now.data(), bytes.data(), bytes.size());
    for (std::size_t w = 0; w < now.size(); ++w) {
      const auto difference = static_cast<std::int64_t>(now[w] - session_detail::guessed_word(now, before, w));
      append_number(records, (static_cast<std::uint64_t>(difference) << 1) ^ (difference < 0 ? ~std::uint64_t{0} : 0));
    }
    before = now;
  }
  records += "\x05";
  const SessionFile file("trephine_session_version_1.bin");
  const Session session = file.load_of(forged(records, 1));
  CHECK(session.report.complete);
  REQUIRE(session.ticks.size() == ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i)
    if (!same(session.ticks[i], ticks[i])) FAIL("tick " << i << " is another");
  REQUIRE(session.tools.size() == 1);
  CHECK(session.tools[0].position == 20);
  CHECK(session.tools[0].number == 7);
  CHECK(contains(file.complaint(forged(records, 2)), "records that are none"));
  CHECK(contains(file.complaint(forged(records, 0)), "has version 0, this reads 1 to 2"));
  CHECK(contains(file.complaint(forged(records, 3)), "has version 3, this reads 1 to 2"));

  // Digits of any number, and files that end within them.
  const auto of_1 = [&](const std::string& bytes) { return file.complaint(forged(bytes, 1)); };
  const std::string refusal = "has a chunk of records that are none";
  for (const std::string& bytes : {std::string("\x01"), "\x01" + std::string(18, '\x01') + std::string(8, 'a'),
                                   "\x01" + std::string(18, '\xff') + std::string(287, 'a')})
    CHECK(contains(of_1(bytes), refusal));
  CHECK(of_1("\x01" + std::string(18, '\x00')) == "none");
  CHECK(of_1("\x01" + std::string(18, '\x01') + std::string(9, 'a')) == "none");
  CHECK(of_1("\x01" + std::string(18, '\xff') + std::string(288, 'a')) == "none");
  // 17 digits are half a byte more than 8 bytes.
  const std::string odd = "\x01" + std::string(8, '\x11') + "\x01" + std::string(9, '\x00');
  CHECK(contains(of_1(odd + std::string(8, 'a')), refusal));
  CHECK(of_1(odd + std::string(9, 'a')) == "none");
  const std::string beyond = odd.substr(1) + std::string(9, 'a');
  std::string_view short_by_half(beyond.data(), beyond.size() - 1);
  RecordedTick none;
  before = {};
  CHECK_FALSE(session_detail::unpack_tick_1(short_by_half, before, none));
}

TEST_CASE("session log: Rice's code gives back numbers of any size, in about their own bits") {
  std::mt19937_64 random(17);
  const auto sizes_of = [&](int trial) { return trial < 64 ? trial : static_cast<int>(random() % 65); };
  std::vector<std::uint64_t> numbers;
  for (int trial = 0; trial < 3000; ++trial) {
    const int size = sizes_of(trial);
    numbers.push_back(size == 0 ? 0 : random() >> (64 - size));
  }
  numbers.insert(numbers.end(), {~std::uint64_t{0}, 0, 1, ~std::uint64_t{0} >> 1, std::uint64_t{1} << 63});
  std::string bytes;
  session_detail::BitWriter out(bytes);
  session_detail::RiceCode writer, reader;
  for (const std::uint64_t n : numbers) writer.put(out, n);
  session_detail::BitReader in(bytes);
  for (const std::uint64_t n : numbers)
    if (reader.take(in) != n) FAIL("another number than " << n);
  CHECK(in.bytes() == bytes.size());
  CHECK_FALSE(in.is_short());
  CHECK(reader.take(in) + 1 > 0);
  CHECK(in.is_short());
  // Numbers of one size cost it and two bits.
  bytes.clear();
  session_detail::BitWriter again(bytes);
  for (int i = 0; i < 1000; ++i) writer.put(again, random() >> 34);
  CHECK(8.0 * static_cast<double>(bytes.size()) / 1000 <= 32.5);
}

TEST_CASE("session log: hostile files are refused in a sentence") {
  const SessionFile file("trephine_session_hostile.bin");
  CHECK(contains(file.complaint(""), "is no trephine session or recording"));
  CHECK(contains(file.complaint("TREPHLO"), "is no trephine session or recording"));
  CHECK(contains(file.complaint("TREPHLOG"), "too short"));
  const std::string head = session_detail::log_head();
  const auto with = [&](std::size_t at, char value) {
    std::string bytes = head.substr(0, head.size() - 8);
    bytes[at] = value;
    append_number(bytes, recording_detail::fnv1a(bytes));
    return file.complaint(bytes);
  };
  CHECK(file.complaint(head) == "none");
  CHECK(contains(with(8, 1), "other byte order"));
  CHECK(contains(with(12, 3), "has version 3, this reads 1 to 2"));
  CHECK(contains(with(16, 9), "ticks of version 9"));
  CHECK(contains(with(20, 1), "bytes"));
  // Whole chunks of no records: an unknown kind, a record that is cut, a length that is none, what follows the end.
  const std::string refusal = "has a chunk of records that are none";
  CHECK(file.complaint(forged("\x05")) == "none");
  for (const std::string& records :
       {std::string("\x09"), std::string("\x00", 1), std::string("\x01"), std::string("\x02") + "1234567",
        std::string("\x04") + "123456789012345", "\x01" + std::string(4, '\x00'), "\x01" + std::string(300, '\xff'),
        std::string("\x05\x05"), std::string("\x02") + "12345678"})
    CHECK(contains(file.complaint(forged(records)), refusal));
  CHECK(file.complaint(forged(std::string("\x03") + "12345678")) == "none");
  // A bit a word.
  CHECK(file.load_of(forged("\x01" + std::string(5, '\x00'))).ticks.size() == 1);
  CHECK(file.load_of(forged("\x01" + std::string(session_detail::kLargestTick, '\xff'))).ticks.size() == 1);
  // Lengths that would need all memory, and numbers of chunks that are not the next: damage.
  for (const std::size_t at : {std::size_t{4}, std::size_t{7}, std::size_t{8}, std::size_t{15}}) {
    std::string bytes = forged("\x05");
    bytes[head.size() + at] = '\xff';
    const Session session = file.load_of(bytes);
    CHECK_FALSE(session.report.complete);
    CHECK(session.report.lost_bytes == bytes.size() - head.size());
  }
  // A chunk that is larger than any that is written, though all of it is there.
  std::string events;
  while (events.size() <= session_detail::kLargestChunk) events += std::string("\x03") + "12345678";
  CHECK(file.load_of(forged(events)).report.lost_bytes == forged(events).size() - head.size());
  CHECK(file.load_of(forged(events.substr(0, events.size() - 9))).events.size() == events.size() / 9 - 1);
  // A chunk twice, and chunks in another order.
  const std::string all = logged(8000);
  std::uint32_t length = 0;
  std::memcpy(&length, all.data() + head.size() + 4, 4);
  const std::string first = all.substr(head.size(), 16 + length + 8);
  const std::size_t of_first = file.load_of(head + first).ticks.size();
  REQUIRE(of_first > 0);
  REQUIRE(of_first < 8000);
  CHECK(file.load_of(head + first + first).ticks.size() == of_first);
  CHECK(file.load_of(head + all.substr(head.size() + first.size()) + first).ticks.empty());
  try {
    (void)load_session(std::filesystem::path("/nonexistent-folder/session"));
    FAIL("a missing file was read");
  } catch (const std::runtime_error& e) {
    CHECK(contains(e.what(), "/nonexistent-folder/session: cannot be opened"));
  }
}

/// A disk that stands still until it is released.
class StalledDisk {
 public:
  explicit StalledDisk(std::string& bytes) : bytes_(bytes) {}
  bool write(std::string_view more) {
    std::unique_lock lock(mutex_);
    bytes_ += more;
    const bool first = !stalls_;
    stalls_ = true;
    if (first) return true;  // the head
    reached_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return released_; });
    return true;
  }
  void wait_until_reached() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return reached_; });
  }
  void release() {
    const std::lock_guard lock(mutex_);
    released_ = true;
    changed_.notify_all();
  }

 private:
  std::string& bytes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stalls_ = false, reached_ = false, released_ = false;
};

TEST_CASE("session log: a disk that stalls delays no tick, takes no memory, and what it costs is counted") {
  // The ticks of five seconds while the disk stands still: a producer that waited for it would wait for ever.
  std::string bytes;
  StalledDisk disk(bytes);
  SessionLog log([&](std::string_view more) { return disk.write(more); }, {.records = 1000, .flush = 0.01});
  CHECK(log.has_room());
  log(numbered(0));
  disk.wait_until_reached();
  std::vector<RecordedTick> ticks;
  for (int i = 1; i <= 5000; ++i) ticks.push_back(numbered(i));
  std::vector<double> times(ticks.size());
  int kept = 1;
  const auto calls = test::heap_calls([&] {
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      kept += log.record(ticks[i].input, ticks[i].dt, ticks[i].result) == RecordStatus::kOk;
      times[i] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
  });
  if (test::AllocationGuard::available()) CHECK(calls == 0);
  CHECK(kept == 1 + 1024);
  CHECK_FALSE(log.has_room());
  CHECK(log.dropped() == 5000 - 1024);
  CHECK(log.tool_changed(3) == RecordStatus::kFull);
  CHECK_FALSE(log.failed());
  disk.release();
  // There is room again before long.
  int more = 0;
  const auto until_kept = [&](const auto& add) {
    for (; add() == RecordStatus::kFull; ++more) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  until_kept([&] { return log.event(7); });
  const int before_tick = more;
  const RecordedTick last = numbered(5001);
  until_kept([&] { return log.record(last.input, last.dt, last.result); });
  log.close();
  const auto expected = static_cast<std::uint64_t>(5000 - 1024 + 1 + more);
  CHECK(log.dropped() == expected);
  const SessionFile file("trephine_session_stalled.bin");
  const Session session = file.load_of(bytes);
  CHECK(session.report.complete);
  CHECK(session.report.dropped.count == expected);
  CHECK(session.report.dropped.time == near(1e-3 * (5000 - 1024 + more - before_tick)));
  CHECK(contains(session.report.text(), std::to_string(expected) + " records dropped"));
  REQUIRE(session.ticks.size() == 1026);
  CHECK(session.ticks[1024].result.contact.count == 1024);
  CHECK(session.ticks[1025].result.contact.count == 5001);
  REQUIRE(session.gaps.size() >= 1);  // told before what found room again
  CHECK(session.gaps[0].position == 1025);
  CHECK(session.gaps[0].dropped.count == static_cast<std::uint64_t>(5000 - 1024 + 1 + before_tick));
  CHECK(session.events.size() == 1);
  std::sort(times.begin(), times.end());
  MESSAGE("a tick's record, median and 99.9 % [ns]: ", 1e9 * times[times.size() / 2], " ",
          1e9 * times[times.size() * 999 / 1000]);
  static_assert(noexcept(log(ticks[0]))&& noexcept(log.tool_changed(1))&& noexcept(log.event(1)));
}

TEST_CASE("session log: what is dropped last is told at the end") {
  std::string bytes;
  StalledDisk disk(bytes);
  SessionLog log([&](std::string_view more) { return disk.write(more); }, {.records = 8, .flush = 0.01});
  log(numbered(0));
  disk.wait_until_reached();
  for (int i = 1; i <= 20; ++i) log(numbered(i));
  disk.release();
  log.close();
  const SessionFile file("trephine_session_dropped_last.bin");
  const Session session = file.load_of(bytes);
  CHECK(session.ticks.size() == 9);
  CHECK(session.report.dropped.count == 12);
  CHECK(session.report.dropped.time == near(12e-3));
  CHECK(session.report.complete);
}

TEST_CASE("session log: a disk that refuses ends the file, and the log says so") {
  std::string bytes;
  int writes = 0;
  const auto sink = [&](std::string_view more) {
    if (++writes == 3) return false;
    bytes += more;
    return true;
  };
  SessionLog log(sink, {.flush = 0.01});
  log(numbered(0));
  const auto ends = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (int i = 1; !log.failed() && std::chrono::steady_clock::now() < ends; ++i) {
    log(numbered(i));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  REQUIRE(log.failed());
  log(numbered(0));
  std::string message;
  try {
    log.close();
  } catch (const std::runtime_error& e) {
    message = e.what();
  }
  CHECK(contains(message, "could not be written to its end"));
  CHECK(contains(message, std::to_string(log.dropped()) + " records"));
  CHECK(log.dropped() >= 2);
  CHECK(writes == 3);  // nothing follows what is missing
  const SessionFile file("trephine_session_refusing_disk.bin");
  const Session session = file.load_of(bytes);
  CHECK_FALSE(session.report.complete);
  CHECK(session.ticks.size() >= 1);

  SessionLog throwing([first = true](std::string_view) mutable {
    if (!std::exchange(first, false)) throw std::runtime_error("no disk");
    return true;
  });
  throwing(numbered(0));
  CHECK_THROWS_AS(throwing.close(), std::runtime_error);
  CHECK(throwing.dropped() == 1);
}

TEST_CASE("session log: what cannot be written or is out of range is refused at once") {
  CHECK_THROWS_AS(SessionLog("/nonexistent-folder/session"), std::runtime_error);
  CHECK_THROWS_AS(SessionLog([](std::string_view) { return false; }), std::runtime_error);
  std::string bytes;
  for (const double flush : {0.0, -1.0, 0.6, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(SessionLog(test::MemorySink{bytes}, {.flush = flush}), std::invalid_argument);
  CHECK_THROWS_AS(SessionLog(test::MemorySink{bytes}, {.records = 0}), std::invalid_argument);
  CHECK_THROWS_AS(SessionLog(test::MemorySink{bytes}, {.records = std::size_t{1} << 40}), std::invalid_argument);
  CHECK(bytes.empty());
}

}  // namespace
