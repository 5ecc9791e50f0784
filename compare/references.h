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
// Reads an image like read_picture(), with the error layers and the seed that the file has.
Result<ReferenceFile> read_reference(const std::filesystem::path& exr, FrameSize size);

// Makes the reference of a race from one file, or from two that are independent of each other. A single file
// with a layer of standard errors s counts as two images: ref + s and ref - s are the means of the two halves
// of its samples, though it is unknown which is which (common/image/reference/reference.h).
Reference combine(const std::vector<ReferenceFile>& files);
std::string describe(const std::vector<ReferenceFile>& files);

}  // namespace ls::race
