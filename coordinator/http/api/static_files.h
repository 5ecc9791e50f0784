// Serves the dashboard's files, which are built into the executable. Files are looked up by their exact names
// in a table in memory, so no request can read other files of the disk. The page's modules and styles are
// joined to one file each, whose name contains its digest; clients that accept gzip get all files compressed.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/http/message/message.h"

namespace ls::http {

struct StaticFile {
  std::string_view name;  // such as "app/main.js"
  std::span<const std::byte> bytes;
};

class StaticFiles {
 public:
  explicit StaticFiles(std::span<const StaticFile> files);
  // Returns the response with the file that the request's path names; "/" names index.html. nullopt: there is
  // no such file.
  std::optional<Response> find(const Request& request) const;

 private:
  struct Entry {
    std::span<const std::byte> bytes;
    std::span<const std::byte> gzip;  // the same compressed; empty: it would not be shorter
    std::string_view content_type;
    std::string digest;
    bool immutable = false;  // its name changes with its bytes
  };
  void add(std::string name, std::span<const std::byte> bytes, bool immutable);
  std::span<const std::byte> keep(std::string text);

  std::map<std::string, Entry, std::less<>> entries_;
  std::vector<std::shared_ptr<const std::string>>
      made_;  // bytes that are built into no program; copies share them
};

std::string_view content_type_of(std::string_view file_name);

// Generated at build time from web/static and coordinator/http/openapi.json.
std::span<const StaticFile> embedded_files();
std::string_view embedded_openapi();

}  // namespace ls::http
