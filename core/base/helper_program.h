// For the main() of a helper program, which only other programs start (spawn.h).
#pragma once

#include <cstdio>
#include <string_view>

namespace ls {

// Answers a person who starts the helper program `name`, and returns the exit code: prints "NAME VERSION" and
// returns 0 if --version is the only argument; else says that other programs start it, and returns 2.
inline int answer_person(const char* name, const char* version, int argc, const char* const* argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--version") {
    std::printf("%s %s\n", name, version);
    return 0;
  }
  std::fprintf(stderr,
               "%s: a helper that other programs of Lightshaft start; `lightshaft --help` lists commands\n",
               name);
  return 2;
}

}  // namespace ls
