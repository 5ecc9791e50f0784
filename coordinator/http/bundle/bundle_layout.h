// Makes a bundle from the files of an archive; the part of bundle.h that reads no archive.
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
  std::vector<BundleFile> files;                 // in the archive's order
  std::map<std::string, std::string> job_files;  // candidates for job.json: text by name
};

Result<Bundle> sorted_out(const BundleContents& contents);

// invalid_argument, "the bundle: ..."; bad_entry() also names the entry.
tl::unexpected<Error> bad_bundle(std::string text);
tl::unexpected<Error> bad_entry(std::string_view name, std::string_view what);

}  // namespace ls::http
