// The seal of a final EXR: the header string `lightshaft:seal` has a line for every layer and every other
// header attribute, sorted: "SHA-256 layer NAME" or "SHA-256 header NAME". A layer's digest is over its
// values row by row, as 32-bit little-endian numbers (halves as floats); an attribute's digest is over its
// type, a zero and its bytes in the file. The seal does not cover how the file stores its pixels
// (compression, order of lines), so repacking does not break it. Used by the files of this folder only.
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
  void add(const Imf::Header& header);  // adds all attributes except the seal itself
  std::string text();                   // returns the seal; call once, at the end

 private:
  std::map<std::string, Sha256> layers_;
  std::map<std::string, Digest> attributes_;
};

// Compares the texts of two seals. Returns the layers and headers that differ ("layer depth.Z"), sorted.
std::vector<std::string> differences(const std::string& sealed, const std::string& now);

}  // namespace ls::exr
