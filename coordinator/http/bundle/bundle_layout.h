// Finds the parts of a bundle (a scene with its files) in the list of an archive's files. It is a step of
// read_bundle() and does not read the archive itself.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/http/bundle/bundle.h"

namespace ls::http {

inline constexpr std::string_view kBundleJobFile = "job.json";

struct BundleFile {
  std::string name;  // normalised
  Digest digest;
};

struct BundleContents {
  std::vector<BundleFile> files;  // in the archive's order
  // The text of every file that may be the bundle's job.json.
  std::map<std::string, std::string> job_files;
};

Result<Bundle> sorted_out(const BundleContents& contents);

// True for files that file managers add to archives and that no scene uses. `name` is as in BundleFile.
bool is_litter(std::string_view name);

// Make errors of the kind invalid_argument whose text begins with "the bundle: "; bad_entry() also names the
// entry.
tl::unexpected<Error> bad_bundle(std::string text);
tl::unexpected<Error> bad_entry(std::string_view name, std::string_view what);

}  // namespace ls::http
