// How the module's readers refuse a file: caught at its door.
#pragma once

#include <string>

namespace ls::render {

struct Refused {
  int code;  // what ls_vdb_read returns: 1 the file is at fault, 2 a limit
  std::string text;
};

}  // namespace ls::render
