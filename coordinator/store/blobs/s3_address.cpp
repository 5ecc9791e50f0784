#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>

#include "coordinator/store/blobs/s3_link.h"
#include "core/base/parse_number.h"

namespace ls::coordinator {
namespace {

constexpr std::string_view kScheme = "s3://";

// True if the text has only letters, digits and the characters in `also`, which must need no escaping in an
// address. So the address that is signed equals the one that is sent.
bool plain(std::string_view text, std::string_view also) {
  return std::all_of(text.begin(), text.end(), [&](unsigned char c) {
    return std::isalnum(c) != 0 || also.find(static_cast<char>(c)) != std::string_view::npos;
  });
}

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

tl::unexpected<Error> wrong(std::string_view url, std::string_view why) {
  return fail(Errc::invalid_argument,
              fmt::format("--blobs '{}' {}; use s3://BUCKET/PREFIX?endpoint=URL&region=NAME", url, why));
}

// Parses a number of MiB from `least` to `most` and returns it in bytes.
std::optional<std::uint64_t> mebibytes(std::string_view text, std::uint64_t least, std::uint64_t most) {
  const auto value = parse_number<std::uint64_t>(text);
  return value && *value >= least && *value <= most ? std::optional(*value << 20) : std::nullopt;
}

Result<void> take_parameters(S3Address& address, std::string_view query, std::string_view url) {
  while (!query.empty()) {
    const std::string_view one = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), one.size() + 1));
    const std::size_t mark = one.find('=');
    const std::string_view name = one.substr(0, mark);
    const std::string value(mark == std::string_view::npos ? std::string_view{} : one.substr(mark + 1));
    if (name == "endpoint")
      address.endpoint = value;
    else if (name == "region")
      address.region = value;
    else if (name == "part-mib" || name == "copies-mib") {
      const bool part = name == "part-mib";
      const auto bytes = part ? mebibytes(value, 5, 5 << 10) : mebibytes(value, 1, std::uint64_t{1} << 40);
      if (!bytes)
        return wrong(url, part ? "has a part-mib that is no whole number from 5 to 5120"
                               : "has a copies-mib that is no whole number of at least 1");
      (part ? address.part_bytes : address.copies_bytes) = *bytes;
    } else
      return wrong(url, fmt::format("has an unknown parameter '{}'", name));
  }
  return {};
}

}  // namespace

std::string S3Address::shown() const {
  return fmt::format("s3://{}{}{} at {}", bucket, prefix.empty() ? "" : "/", prefix, endpoint);
}

Result<S3Address> parse_s3_url(std::string_view url) {
  if (!url.starts_with(kScheme)) return wrong(url, "does not begin with s3://");
  const std::string_view rest = url.substr(kScheme.size());
  const std::size_t mark = std::min(rest.find('?'), rest.size());
  std::string_view path = rest.substr(0, mark);
  while (path.ends_with('/')) path.remove_suffix(1);
  S3Address address;
  const std::size_t slash = std::min(path.find('/'), path.size());
  address.bucket = path.substr(0, slash);
  address.prefix = path.substr(std::min(path.size(), slash + 1));
  if (auto taken = take_parameters(address, rest.substr(std::min(rest.size(), mark + 1)), url); !taken)
    return tl::unexpected(taken.error());
  if (address.bucket.size() < 3 || !plain(address.bucket, ".-")) return wrong(url, "names no bucket");
  if (!plain(address.prefix, "._-/") || address.prefix.find("//") != std::string::npos ||
      address.prefix.starts_with('/') || address.prefix.find("..") != std::string::npos)
    return wrong(url, "has a prefix with other characters than letters, digits, '.', '_', '-' and '/'");
  if (address.region.empty()) address.region = environment("AWS_REGION");
  if (address.region.empty()) address.region = environment("AWS_DEFAULT_REGION");
  if (address.region.empty()) address.region = "us-east-1";
  if (!plain(address.region, "-")) return wrong(url, "names a region that cannot be one");
  if (address.endpoint.empty()) address.endpoint = fmt::format("https://s3.{}.amazonaws.com", address.region);
  while (address.endpoint.ends_with('/')) address.endpoint.pop_back();
  const bool web = address.endpoint.starts_with("https://") || address.endpoint.starts_with("http://");
  if (!web || !plain(address.endpoint, ".-:/[]_"))
    return wrong(url, "has an endpoint that is no http or https address");
  return address;
}

Result<S3Keys> s3_keys_from_environment() {
  S3Keys keys{environment("AWS_ACCESS_KEY_ID"), environment("AWS_SECRET_ACCESS_KEY"),
              environment("AWS_SESSION_TOKEN")};
  const auto printable = [](const std::string& s) {
    return std::all_of(s.begin(), s.end(), [](unsigned char c) { return c > ' ' && c < 0x7f; });
  };
  const char* missing = keys.id.empty()       ? "AWS_ACCESS_KEY_ID"
                        : keys.secret.empty() ? "AWS_SECRET_ACCESS_KEY"
                                              : nullptr;
  if (missing)
    return fail(Errc::unauthenticated,
                fmt::format("--blobs s3://... needs keys: set {} in the coordinator's environment", missing));
  if (!printable(keys.id) || !printable(keys.secret) || !printable(keys.session) ||
      keys.id.find(':') != std::string::npos)
    return fail(Errc::unauthenticated,
                "the AWS_* keys in the coordinator's environment have characters that none has");
  return keys;
}

}  // namespace ls::coordinator
