// The seal of a final EXR is the header string `lightshaft:seal`. It has a line "DIGEST header NAME" for
// every header attribute that it covers, then a line "DIGEST layer NAME" for every layer, both sorted by
// name. DIGEST is a SHA-256 in hexadecimal. A layer's digest is over its values row by row, as 32-bit
// little-endian numbers (halves as floats). An attribute's digest is over its type, a zero byte and its bytes
// in the file. In a file of several parts, the names of attributes of a part but the first begin with its
// name and a colon. The seal does not cover itself, nor the attributes "compression", "lineOrder",
// "chunkCount" and "type", so it stays valid if a program stores the same pixels with another compression or
// order of lines. Used by the files of this folder only.
#pragma once

#include <ImfHeader.h>

#include <map>
#include <string>
#include <vector>

#include "core/base/digest.h"
#include "core/image/exr/exr_file.h"

namespace ls::exr {

inline constexpr const char* kSealName = "lightshaft:seal";

class Seal {
 public:
  // Adds the next rows of the image, from the top down, to the digests of the layers.
  void add(const ExrPicture& rows);
  // Computes the digests of the attributes that the seal covers in the header of the next part.
  void add(const Imf::Header& header);
  // Returns the text of the seal. May be called only once, after all rows are added.
  std::string text();

 private:
  std::map<std::string, Sha256> layers_;
  std::map<std::string, Digest> attributes_;
  bool first_part_ = true;
};

// Returns the values of the samples of a deep image, by the names of their channels, as the seal takes them:
// the layer "samples" has the numbers of samples of the pixels.
ExrPicture values_of(const DeepRows& rows, bool colours, bool halves);

// Compares the texts of two seals. Returns the names of the layers and headers whose digests differ ("layer
// depth.Z"), sorted.
std::vector<std::string> differences(const std::string& sealed, const std::string& now);

}  // namespace ls::exr
