# SPDX-License-Identifier: MIT
"""check_includes.py INCLUDE [EXPECTED...]: no header includes what it names nothing of, or names Eigen without reading it.

INCLUDE holds trephine/. A header is looked at as text: of each other header of ours that it includes, it must use some
name that is declared there; of a standard header, one of those below. Headers that declare nothing (they only gather
others) are left out, and so are headers of other libraries. With EXPECTED, exactly these `header: included` pairs must
be found: how the check itself is tested."""

import os
import re
import sys

# What a standard header is included for; one that is not here is taken to be used.
STANDARD = {
    "algorithm": r"std::(max|min|clamp|fill|sort|copy|count|find|swap_ranges|any_of|all_of|none_of|equal|transform|"
                 r"nth_element|lower_bound|upper_bound|remove|unique|reverse|rotate|for_each|ranges|stable_sort)",
    "array": r"std::array",
    "atomic": r"std::(atomic|memory_order)",
    "bit": r"std::(bit_|countr_|countl_|popcount|has_single_bit|endian)",
    "chrono": r"chrono",
    "cmath": r"std::(abs|sqrt|sin|cos|tan|atan|acos|asin|exp|log|pow|floor|ceil|round|l?lround|is(finite|nan|inf)|"
             r"hypot|fmod|cbrt|nearbyint|trunc|copysign|remainder|erf|nextafter|modf|fma|ldexp|frexp|signbit|fmax|fmin)",
    "concepts": r"std::(same_as|derived_from|convertible_to|invocable|predicate|floating_point|integral|regular|"
                r"copyable|constructible_from|default_initializable|signed_integral|unsigned_integral|movable)",
    "cstddef": r"std::(size_t|ptrdiff_t|byte|nullptr_t)",
    "cstdint": r"std::u?int",
    "cstdlib": r"std::(getenv|malloc|free|abort|strto)",
    "cstring": r"std::(mem|str)",
    "exception": r"std::(exception|current_exception|rethrow|terminate)",
    "fstream": r"fstream",
    "functional": r"std::(function|ref|less|greater|plus|hash|invoke|cref)",
    "limits": r"numeric_limits",
    "memory": r"std::(unique_ptr|shared_ptr|make_unique|make_shared|weak_ptr|addressof|assume_aligned)",
    "numbers": r"std::numbers",
    "optional": r"std::(optional|nullopt)",
    "span": r"std::span",
    "stdexcept": r"std::(runtime_error|invalid_argument|logic_error|out_of_range)",
    "string": r"std::(string\b|to_string)",
    "string_view": r"string_view",
    "thread": r"std::(thread|this_thread)",
    "tuple": r"std::(tuple|apply|get|tie|ignore)",
    "type_traits": r"std::(is_|conditional|remove_|decay|enable_if|void_t|true_type|false_type|common_type|"
                   r"underlying_type|integral_constant|make_unsigned|make_signed|invoke_result|bool_constant|type_identity)",
    "utility": r"std::(move|pair|exchange|forward|swap|as_const|declval|index_sequence|make_index_sequence|make_pair)",
    "vector": r"std::vector",
}


def code(path):
    """A file without comments and texts."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    text = re.sub(r"//[^\n]*", "", text)
    return re.sub(r'"(\\.|[^"\\\n])*"', '""', text)


def declared(text):
    """Names of types, concepts, aliases and of functions that begin in the first column."""
    names = set(re.findall(r"\b(?:class|struct|concept|enum class|enum|using)\s+(\w+)", text))
    names |= set(re.findall(r"\bconstexpr [\w:<>, ]+?[ &*](\w+)(?:<[^=;]*>)? ?[={]", text))
    for line in text.split("\n"):
        if line and not line[0].isspace() and line[0] not in "#}":
            names |= set(re.findall(r"(\w+)\(", line)) | set(re.findall(r'operator""\s*(\w+)', line))
    return names - {"requires", "static_assert", "noexcept", "decltype", "explicit", "sizeof"}


def reached(header, texts, seen):
    """All that a header includes, itself or through others of ours."""
    for included in re.findall(r"#include <([^>]+)>", texts.get(header, "")):
        if included not in seen:
            seen.add(included)
            reached(included, texts, seen)
    return seen


def main():
    root = sys.argv[1]
    texts = {}
    for folder, _, files in os.walk(os.path.join(root, "trephine")):
        for name in files:
            if name.endswith(".hpp"):
                path = os.path.join(folder, name)
                texts[os.path.relpath(path, root)] = code(path)
    if not texts:
        print(f"no headers in {root}/trephine", file=sys.stderr)
        return 1
    names = {header: declared(text) for header, text in texts.items()}
    found = []
    for header, text in sorted(texts.items()):
        eigen = any(name.startswith("Eigen/") for name in reached(header, texts, set()))
        # Bodies stand behind the header that includes them.
        if "Eigen::" in text and not eigen and not header.endswith("_impl.hpp"):
            found.append(f"{header}: Eigen/Core")
        if not names[header]:
            continue
        # The bodies that a header includes at its end are part of it.
        body = text + texts.get(header.replace(".hpp", "_impl.hpp"), "")
        body = re.sub(r"^\s*#include.*$", "", body, flags=re.M)
        words = set(re.findall(r"\w+", body))
        for included in re.findall(r"#include <([^>]+)>", text):
            if included in names:
                used = not names[included] or words & names[included] or included.endswith("_impl.hpp")
            else:
                used = included not in STANDARD or re.search(STANDARD[included], body)
            if not used:
                found.append(f"{header}: {included}")
    expected = sys.argv[2:]
    if expected:
        if found == expected:
            return 0
        print(f"expected {expected}, found {found}", file=sys.stderr)
        return 1
    for pair in found:
        print(f"{pair} is included and nothing of it used, or the other way round", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
