// The vocabulary of pbrt's files: each directive with its types and their parameters, and how they are
// translated. The reader checks parameters against this table, and docs/reference/pbrt.md is generated from
// it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::scene::pbrt {

struct Word {
  enum class Use { read, ignored, refused };
  std::string_view name;
  std::string_view types;  // type in the file, written before the name; several are separated by "|"
  std::string_view fallback;
  std::string_view meaning;  // the meaning; for a parameter that is not read, the reason
  Use use = Use::read;
};

struct Row {
  std::string_view directive, type;
  bool is_read;
  std::string_view meaning;  // how it is translated; for a rejected type, the reason and what to do
  std::vector<Word> words;
  const Word* find(std::string_view name) const;
};

std::span<const Row> rows();
const Row* find_row(std::string_view directive, std::string_view type);
std::vector<std::string> types_of(std::string_view directive);  // returns the types that are read

// Directives without types, with their meanings.
struct Plain {
  std::string_view name, meaning;
};
std::span<const Plain> plain_directives();

}  // namespace ls::scene::pbrt
