// The vocabulary of pbrt's files: each directive with its types and their parameters, and how they are
// translated. The class Params (parameters.h) checks parameters against this table, and
// docs/reference/pbrt.md is generated from it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ls::scene::pbrt {

struct Word {
  enum class Use { read, ignored, refused };
  std::string_view name;
  // The types that the parameter may have, separated by "|". In a file the type is written before the name.
  std::string_view types;
  std::string_view fallback;
  std::string_view meaning;  // what the parameter means; if it is not read, why not
  Use use = Use::read;
};

struct Row {
  std::string_view directive, type;
  bool is_read;
  // How the type is translated; if it is not read, why not, and what to do instead.
  std::string_view meaning;
  std::vector<Word> words;
  const Word* find(std::string_view name) const;
};

std::span<const Row> rows();
const Row* find_row(std::string_view directive, std::string_view type);
std::vector<std::string> types_of(std::string_view directive);  // returns the types that are read

// A directive that has no types, and its meaning.
struct Plain {
  std::string_view name, meaning;
};
std::span<const Plain> plain_directives();

}  // namespace ls::scene::pbrt
