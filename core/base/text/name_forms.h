// Compares names of files that people write in more than one way.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace ls {

// Returns the name with letters and their accents composed, as most systems write them (NFC of Unicode):
// macOS stores names decomposed (NFD), so that one name has two spellings that look the same. Knows the
// letters of Latin, Greek and Cyrillic, Japanese kana and Korean hangul; all others, and bytes that are not
// UTF-8, stay as they are.
std::string composed(std::string_view name);

// Returns the name with / between folders in place of the backslash of Windows.
std::string with_slashes(std::string_view name);

// Looks in `folder` for the file that `name` may mean although there is none of exactly this name: its
// folders are separated by backslashes, or its letters are composed otherwise. nullopt: there is none, or
// several.
std::optional<std::filesystem::path> written_otherwise(const std::filesystem::path& folder,
                                                       std::string_view name);

}  // namespace ls
