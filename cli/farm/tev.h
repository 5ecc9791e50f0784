// Shows images of jobs in tev (https://github.com/Tom94/tev), over its TCP protocol.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cli/farm/farm_api.h"
#include "cli/farm/tcp.h"
#include "core/image/frame/frame.h"

namespace ls::cli {

// Where tev listens unless it was started with --host.
inline constexpr const char* kTevAddress = "127.0.0.1:14158";

class Tev {
 public:
  // Connects to the tev at HOST:PORT.
  static Result<Tev> open(const std::string& address);

  // Sends the image of the job as it is now: all its layers, or with all_layers = false its colours only. Of
  // a sequence it is the frame that is the most interesting now. `job`: the job as JSON. An image that tev
  // has of the job is replaced.
  FarmApi::Answer<void> show(FarmApi& api, const nlohmann::json& job, bool all_layers);

 private:
  struct Layer {
    std::string name;
    std::vector<std::string> channels;  // as tev shall name them
    bool half = true;                   // how the coordinator sends the values
  };
  explicit Tev(TcpConnection connection) : connection_(std::move(connection)) {}
  FarmApi::Answer<void> show_layer(FarmApi& api, const std::string& path, const std::string& image,
                                   const Layer& layer, FrameSize size);
  FarmApi::Answer<void> send(const std::vector<std::byte>& packet);

  TcpConnection connection_;
  std::string created_;  // image, size and channels that tev was sent last
};

}  // namespace ls::cli
