#include "validation/options.h"

#include <CLI/CLI.hpp>

namespace ls::cases {

void add_options(CLI::App& app, Options& o) {
  const auto option = [&](const char* name, auto& value, const char* type, const char* help) {
    return app.add_option(name, value, help)->type_name(type);
  };
  option("file", o.file, "FILE", "Nori XML with a <test>; without: the table of cases");
  option("--case", o.only, "NAME",
         "only the cases whose names begin so or match the glob; of FILE: with this in their name");
  app.add_flag("--quick", o.quick, "bands of 1 % for .3 %, without the longest cases");
  option("--json", o.json, "OUT", "the table as JSON, too");
  option("--seed", o.seed, "N", "default 0");
  option("--threads", o.threads, "N", "default all")->check(CLI::Range(1, 1024));
  app.add_flag("--strict", o.strict, "warnings are errors");
}

}  // namespace ls::cases
