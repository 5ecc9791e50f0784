// From the files of an archive to a bundle; the part of bundle.h that reads no archive.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/http/bundle.h"

namespace ls::http {

inline constexpr std::string_view kBundleJobFile = "job.json";

struct BundleFile {
  std::string name;  // normalised
  Digest digest;
};

struct BundleContents {
  std::vector<BundleFile> files;                 // in the archive's order
  std::map<std::string, std::string> job_files;  // those that may be job.json: text by name
};

Result<Bundle> sorted_out(const BundleContents& contents);

// invalid_argument, "the bundle: ..."; with the entry that it is about.
tl::unexpected<Error> bad_bundle(std::string text);
tl::unexpected<Error> bad_entry(std::string_view name, std::string_view what);

}  // namespace ls::http
