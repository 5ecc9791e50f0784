// Pictures that a user gives to measure against.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/compare/picture.h"
#include "common/image/reference.h"

namespace ls::race {

struct ReferenceFile {
  std::string name;  // without folders
  ls::Reference picture;
};
// As read_picture(), with what the file says of its own errors and its seed.
Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size);

// One file, or two that are independent of each other. One that brings its standard errors s is two: ref + s
// and ref - s are the means of its halves, though in which order is not known (common/image/reference.h).
Reference combine(const std::vector<ReferenceFile>& files);
std::string describe(const std::vector<ReferenceFile>& files);

}  // namespace ls::race
