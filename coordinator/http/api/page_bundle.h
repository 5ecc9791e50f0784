// Joins the modules and the styles of the dashboard to one file each. A browser that loads some seventy
// modules one by one waits for a round trip of the network each time.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "coordinator/http/api/static_files.h"

namespace ls::http {

struct PageBundle {
  std::string page;                     // index.html, which names the two files below
  std::string script;                   // js/main.js and all that it imports
  std::string style;                    // the style sheets that index.html names
  std::string script_name, style_name;  // they contain the digest of what they name
};

// nullopt: index.html or a module is written in a way that is not known here; the files are served one by one
// then. Known are imports and exports of one line: import "./x.js"; import { a, b as c } from "./x.js";
// export const, export function, export async function and export class.
std::optional<PageBundle> bundle_page(std::span<const StaticFile> files);

}  // namespace ls::http
