// The seal of a final EXR is the header string `lightshaft:seal`. It has a line "SHA-256 header NAME" for
// every header attribute that it covers, then a line "SHA-256 layer NAME" for every layer, both sorted by
// name. A layer's digest is over its values row by row, as 32-bit little-endian numbers (halves as floats).
// An attribute's digest is over its type, a zero byte and its bytes in the file. The seal does not cover
// itself, nor the attributes about the storage of the pixels (compression, order of lines), so it stays valid
// if the file is repacked. Used by the files of this folder only.
#pragma once

#include <ImfHeader.h>

#include <map>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/image/exr/exr_file.h"

namespace ls::exr {

inline constexpr const char* kSealName = "lightshaft:seal";

class Seal {
 public:
  void add(const ExrPicture& rows);     // adds the next rows of every layer, from the top
  void add(const Imf::Header& header);  // adds the attributes that the seal covers
  std::string text();                   // returns the seal; call once, at the end

 private:
  std::map<std::string, Sha256> layers_;
  std::map<std::string, Digest> attributes_;
};

// Compares the texts of two seals. Returns the layers and headers that differ ("layer depth.Z"), sorted.
std::vector<std::string> differences(const std::string& sealed, const std::string& now);

}  // namespace ls::exr
