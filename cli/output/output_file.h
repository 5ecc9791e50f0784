// Writes output files completely or not at all.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/frame_range.h"
#include "util/display/display_views.h"
#include "util/protocol/messages.h"

namespace ls::cli {

// Checks before a long render that a file of this name can be written, by creating and removing another file
// in its folder; the file itself is not touched. `option` is the command line option that names the file, for
// messages.
Result<void> check_output(const std::string& option, const std::filesystem::path& file);
// How the result of a job is written: all layers as EXR, the colours as an 8-bit sRGB PNG, or what meters
// have measured as JSON.
enum class ImageFormat { exr, png, json };
// Returns the format from the file name's extension, in upper or lower case; EXR if it has none.
// invalid_argument: it has the extension of another format.
Result<ImageFormat> image_format(const std::filesystem::path& file);
// Reads the views of this machine for --view `view`, an option for images that are written as PNG to `out`.
// null: `view` is empty. invalid_argument: `out` is no PNG, or there is no such view.
Result<std::shared_ptr<const DisplayViews>> views_for(const std::string& view, const std::string& out);
// Checks that --view may be given for `out`.
Result<void> check_view(const std::string& view, const std::string& out);
// Returns the name of the deep image beside the image of this name: out.deep.exr beside out.exr.
std::filesystem::path deep_file(const std::filesystem::path& image);
Result<void> check_folder(const std::string& option, const std::filesystem::path& folder);
// Checks the name of an output file that is written once per frame. invalid_argument: there are several
// frames, and the name has no # to distinguish their files.
Result<void> check_numbered(const std::string& option, const std::string& name, const FrameRange& frames);
// Checks, before a job begins, that the output file `name`, or one such file per frame, can be written. If
// `option` is "-o", the file is an image, and image_format() must accept its name. If there are several
// frames, the name must have a # for their numbers; only "--report" may name a single file for all frames.
Result<void> check_outputs(const std::string& option, const std::string& name,
                           const std::optional<FrameRange>& frames);
Result<void> write_output(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_output(const std::filesystem::path& file, const std::string& text);
// Writes a result that must not be lost. If it cannot be written to `file`, it is written to a new file in
// the folder for temporary files, and the returned error names that file.
Result<void> save_result(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> save_result(const std::filesystem::path& file, const std::string& text);

// Stores the partial (the pixel sums) of every unit of a render as an EXR file in a folder, for `lightshaft
// merge`.
class PartialDir {
 public:
  // Creates the folder if it is missing. Files of earlier renders stay, except those of the same tile and
  // round, which are replaced.
  static Result<PartialDir> open(std::filesystem::path folder);

  Result<void> keep(const UnitResult& result);
  // Removes the files of rounds that are not part of the image. There may be such files, because later rounds
  // of a tile may already have been rendered when the tile reaches the target error. `folded` is the number
  // of rounds of each tile that are part of the image.
  Result<void> drop_unfolded(std::span<const RoundIndex> folded);

  std::filesystem::path path(TileIndex tile, RoundIndex round) const;

 private:
  explicit PartialDir(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
  std::vector<std::pair<TileIndex, RoundIndex>> kept_;
};

}  // namespace ls::cli
