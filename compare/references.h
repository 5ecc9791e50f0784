// Reference images given by the user.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/image/reference/reference.h"
#include "compare/picture.h"

namespace ls::race {

struct ReferenceFile {
  std::string name;  // without folders
  ls::Reference picture;
};
// Like read_picture(), with the error layers and seed that the file has.
Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size);

// One file, or two that are independent of each other. A file with standard errors s counts as two: ref + s
// and ref - s are the means of its halves, in unknown order (common/image/reference/reference.h).
Reference combine(const std::vector<ReferenceFile>& files);
std::string describe(const std::vector<ReferenceFile>& files);

}  // namespace ls::race
