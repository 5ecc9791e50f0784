// Joins the modules and the styles of the dashboard to one file for each script of the page, without
// comments, and one for all styles. A browser that loads some seventy modules one by one waits for a round
// trip of the network each time.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "coordinator/http/api/static_files.h"

namespace ls::http {

// A file made of several, whose name contains the digest of its text
struct JoinedFile {
  std::string name, text;
};

struct PageBundle {
  std::string page;  // index.html, which names the files below
  // The scripts that index.html names, in their order, each with all that it imports and no earlier one has
  std::vector<JoinedFile> scripts;
  JoinedFile style;  // the style sheets that index.html names
};

// nullopt: index.html or a module is written in a way that is not known here; the files are served one by one
// then. Known are imports and exports of one line: import "./x.js"; import { a, b as c } from "./x.js";
// export const, export function, export async function and export class.
std::optional<PageBundle> bundle_page(std::span<const StaticFile> files);

}  // namespace ls::http
