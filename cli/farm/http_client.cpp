#include "cli/farm/http_client.h"

#include <curl/curl.h>
#include <fmt/format.h>
#include <poll.h>
#include <strings.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <mutex>

#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

namespace fs = std::filesystem;

constexpr long kConnectSeconds = 15;
constexpr long kStallSeconds = 60;  // a transfer that moves no byte for this long fails
constexpr long kRedirects = 3;
constexpr double kRemoteSeconds = 120;
constexpr int kFirstPauseMilliseconds = 250, kLongestPauseMilliseconds = 4000;
constexpr long kWorkSeconds = 3600;  // instead of kStallSeconds, if the server's work may take long

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using FilePtr = std::unique_ptr<std::FILE, CloseFile>;
struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using Headers = std::unique_ptr<curl_slist, FreeList>;

void add(Headers& headers, const std::string& line) {
  headers.reset(curl_slist_append(headers.release(), line.c_str()));
}

// Receives an answer's body: into a file, if one is given and the request succeeds; otherwise into memory.
struct Receiver {
  CURL* curl = nullptr;
  HttpResponse* response = nullptr;
  std::FILE* file = nullptr;
  bool too_large = false, write_failed = false;

  static std::size_t receive(char* data, std::size_t size, std::size_t count, void* self_pointer) {
    auto& self = *static_cast<Receiver*>(self_pointer);
    const std::size_t bytes = size * count;
    long status = 0;
    curl_easy_getinfo(self.curl, CURLINFO_RESPONSE_CODE, &status);
    if (self.file && status / 100 == 2) {
      self.write_failed = std::fwrite(data, 1, bytes, self.file) != bytes;
      return self.write_failed ? 0 : bytes;
    }
    self.too_large = self.response->body.size() + bytes > HttpClient::kMaxAnswerBytes;
    if (self.too_large) return 0;
    self.response->body.append(data, bytes);
    return bytes;
  }
};

// Returns the value of the header `name` if `line` contains it.
std::optional<std::string> header_value(std::string_view line, std::string_view name) {
  if (line.size() <= name.size() || line[name.size()] != ':' ||
      ::strncasecmp(line.data(), name.data(), name.size()) != 0)
    return std::nullopt;
  line.remove_prefix(name.size() + 1);
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  return std::string(line.substr(0, line.find_first_of("\r\n")));
}

std::size_t take_header(char* data, std::size_t size, std::size_t count, void* response_pointer) {
  auto& response = *static_cast<HttpResponse*>(response_pointer);
  const std::string_view line(data, size * count);
  if (const auto text = header_value(line, "Upload-Offset")) {
    std::uint64_t offset = 0;
    if (std::from_chars(text->data(), text->data() + text->size(), offset).ec == std::errc())
      response.upload_offset = offset;
  } else if (const auto date_text = header_value(line, "Date")) {
    const std::time_t date = curl_getdate(date_text->c_str(), nullptr);
    if (date != -1) response.date = date;
  }
  return size * count;
}

// Notes in a text which proxy is used. libcurl tells this only in what it prints for debugging:
// "Uses proxy env variable http_proxy == 'http://proxy:3128'".
int take_debug(CURL*, curl_infotype type, char* data, std::size_t size, void* proxy_pointer) {
  constexpr std::string_view kBegins = "Uses proxy env variable ", kEquals = " == '";
  std::string_view line(data, size);
  if (type != CURLINFO_TEXT || !line.starts_with(kBegins)) return 0;
  line.remove_prefix(kBegins.size());
  const std::size_t equals = line.find(kEquals);
  const std::string_view variable = line.substr(0, equals);
  if (equals == std::string_view::npos || variable == "no_proxy" || variable == "NO_PROXY") return 0;
  std::string_view proxy = line.substr(equals + kEquals.size());
  proxy = proxy.substr(0, proxy.rfind('\''));
  // A password may stand before the host.
  const std::size_t host = proxy.rfind('@') + 1, scheme = proxy.find("://");
  const std::string shown = host == 0 ? std::string(proxy)
                                      : std::string(scheme < host ? proxy.substr(0, scheme + 3) : "") +
                                            std::string(proxy.substr(host));
  *static_cast<std::string*>(proxy_pointer) =
      fmt::format("{} of the variable {}", plain_text(shown), plain_text(variable));
  return 0;
}

std::size_t read_file_chunk(char* data, std::size_t size, std::size_t count, void* file) {
  return std::fread(data, 1, size * count, static_cast<std::FILE*>(file));
}

Result<void> check_url(const std::string& url) {
  const auto wrong = [&](std::string_view why) {
    return bad_argument(fmt::format("the coordinator's address '{}' {}", url, why));
  };
  if (!url.starts_with("http://") && !url.starts_with("https://"))
    return wrong("must begin with http:// or https://");
  if (std::any_of(url.begin(), url.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; }))
    return wrong("has spaces or control characters");
  return {};
}

}  // namespace

struct HttpClient::State {
  Options options;
  std::vector<std::string> urls;
  std::size_t current = 0;  // index of the address that answered last
  CURL* curl = nullptr;
  long stall_seconds = kStallSeconds;
  ~State() { curl_easy_cleanup(curl); }

  Result<HttpResponse> perform(const std::string& path, const Headers& headers, std::FILE* save);
  Result<HttpResponse> send(const std::string& path, const fs::path& file, std::string_view content_type,
                            std::optional<std::uint64_t> offset = std::nullopt);
  void set_common(const std::string& url, const Headers& headers);
  Headers headers() const {
    Headers list;
    if (!options.token.empty()) add(list, "Authorization: Bearer " + options.token);
    return list;
  }
};

namespace {

// Returns the beginning of an address that was given without one. The token must not cross a network in
// clear text unless the user asks for it, so http:// is only for this machine.
const char* scheme_of(std::string_view address, bool has_ca) {
  const bool local =
      address.starts_with("localhost") || address.starts_with("127.") || address.starts_with("[::1]");
  return local && !has_ca ? "http://" : "https://";
}

}  // namespace

std::vector<std::string> addresses_in(const std::string& url, bool has_ca) {
  std::vector<std::string> addresses;
  for (std::size_t at = 0; at <= url.size();) {
    const std::size_t comma = std::min(url.find(',', at), url.size());
    addresses.push_back(url.substr(at, comma - at));
    while (addresses.back().ends_with('/')) addresses.back().pop_back();
    if (!addresses.back().empty() && addresses.back().find("://") == std::string::npos)
      addresses.back().insert(0, scheme_of(addresses.back(), has_ca));
    at = comma + 1;
  }
  return addresses;
}

Result<HttpClient> HttpClient::open(Options options) {
  std::vector<std::string> urls = addresses_in(options.url, !options.ca.empty());
  for (const std::string& url : urls)
    if (auto ok = check_url(url); !ok) return tl::unexpected(ok.error());
  if (std::any_of(options.token.begin(), options.token.end(),
                  [](unsigned char c) { return c <= ' ' || c >= 0x7f; }))
    return bad_argument("the token has characters that a token cannot have");
  std::error_code error;
  if (!options.ca.empty() && !fs::exists(options.ca, error))
    return bad_argument(fmt::format("there is no CA file {}", options.ca));
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  auto state = std::make_unique<State>();
  state->options = std::move(options);
  state->urls = std::move(urls);
  state->curl = curl_easy_init();
  if (!state->curl) return fail(Errc::internal, "libcurl cannot be started");
  return HttpClient(std::move(state));
}

HttpClient::HttpClient(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpClient::HttpClient(HttpClient&&) noexcept = default;
HttpClient::~HttpClient() = default;

void HttpClient::State::set_common(const std::string& url, const Headers& headers) {
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "lightshaft/" LIGHTSHAFT_VERSION);
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  // A coordinator may redirect to another coordinator of the farm, which has the job. The token is valid for
  // the whole farm, so it is sent on (UNRESTRICTED_AUTH). A redirect from TLS to an address without TLS is
  // not followed.
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 1L);
  curl_easy_setopt(curl, CURLOPT_MAXREDIRS, kRedirects);
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS_STR, url.starts_with("https:") ? "https" : "http,https");
  curl_easy_setopt(curl, CURLOPT_UNRESTRICTED_AUTH, 1L);
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, stall_seconds);
  curl_easy_setopt(curl, CURLOPT_TCP_KEEPALIVE, 1L);
  if (!options.ca.empty()) curl_easy_setopt(curl, CURLOPT_CAINFO, options.ca.c_str());
}

Result<HttpResponse> HttpClient::State::perform(const std::string& path, const Headers& headers,
                                                std::FILE* save) {
  HttpResponse response;
  Receiver receiver{curl, &response, save};
  char problem[CURL_ERROR_SIZE] = "";
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, &Receiver::receive);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &receiver);
  curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, &take_header);
  curl_easy_setopt(curl, CURLOPT_HEADERDATA, &response);
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, problem);
  curl_easy_setopt(curl, CURLOPT_DEBUGFUNCTION, &take_debug);
  curl_easy_setopt(curl, CURLOPT_DEBUGDATA, &response.proxy);
  curl_easy_setopt(curl, CURLOPT_VERBOSE, 1L);
  CURLcode code = CURLE_OK;
  for (std::size_t tried = 0; tried < urls.size(); ++tried) {
    response.proxy.clear();
    set_common(urls[current] + path, headers);
    code = curl_easy_perform(curl);
    if (code != CURLE_COULDNT_CONNECT || urls.size() == 1) break;
    current = (current + 1) % urls.size();  // without a connection nothing was sent: try the next address
  }
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  response.status = static_cast<int>(status);
  curl_easy_reset(curl);  // resets the options; the connection stays open
  if (code == CURLE_OK) return response;
  if (receiver.too_large)
    return fail(Errc::resource_exhausted,
                fmt::format("the answer to {} is larger than {} bytes", path, kMaxAnswerBytes));
  if (receiver.write_failed)
    return fail(Errc::resource_exhausted, "the answer cannot be written: is the disk full?");
  // The server rejected an upload before its end. Its response is more informative than the broken
  // connection.
  if (code == CURLE_SEND_ERROR && status >= 400) return response;
  const std::string asked = urls[current];
  if (code == CURLE_UNSUPPORTED_PROTOCOL)
    return fail(Errc::unavailable,
                fmt::format("{} sends this on to an address that is not https: no token goes there; let the "
                            "coordinators name each other by https (--public-http)",
                            asked));
  if (code != CURLE_COULDNT_CONNECT) current = (current + 1) % urls.size();
  if (code == CURLE_SSL_CONNECT_ERROR &&
      std::string_view(problem).find("wrong version number") != std::string::npos)
    return fail(Errc::unavailable,
                fmt::format("{} answers without TLS: its address begins with http://", asked));
  return fail(Errc::unavailable,
              fmt::format("{} cannot be reached{}: {}{}",
                          urls.size() > 1 && code == CURLE_COULDNT_CONNECT ? options.url : asked,
                          response.proxy.empty() ? "" : " through the proxy " + response.proxy,
                          *problem ? problem : curl_easy_strerror(code),
                          response.proxy.empty() ? "" : "; to go there directly, name its host in no_proxy"));
}

Result<HttpResponse> HttpClient::request(std::string_view method, const std::string& path,
                                         std::string_view body, std::string_view content_type) {
  Headers headers = state_->headers();
  const std::string verb(method);
  CURL* curl = state_->curl;
  if (verb == "HEAD") {
    curl_easy_setopt(curl, CURLOPT_NOBODY, 1L);
  } else if (verb != "GET") {
    add(headers, fmt::format("Content-Type: {}", content_type));
    curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
    curl_easy_setopt(curl, CURLOPT_COPYPOSTFIELDS, body.empty() ? "" : body.data());
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, verb.c_str());
  }
  return state_->perform(path, headers, nullptr);
}

// Sends a file by PUT, unless another method is set.
Result<HttpResponse> HttpClient::State::send(const std::string& path, const fs::path& file,
                                             std::string_view content_type,
                                             std::optional<std::uint64_t> offset) {
  const FilePtr source(std::fopen(file.c_str(), "rbe"));
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  if (!source || error) return fail(Errc::not_found, fmt::format("{} cannot be read", file.string()));
  const std::uint64_t from = offset.value_or(0);
  if (from > bytes || ::fseeko(source.get(), static_cast<off_t>(from), SEEK_SET) != 0)
    return fail(Errc::not_found, fmt::format("{} has no byte {}: has it changed?", file.string(), from));
  Headers list = headers();
  add(list, fmt::format("Content-Type: {}", content_type));
  if (offset)
    add(list, from < bytes ? fmt::format("Content-Range: bytes {}-{}/{}", from, bytes - 1, bytes)
                           : fmt::format("Content-Range: bytes */{}", bytes));
  curl_easy_setopt(curl, CURLOPT_UPLOAD, 1L);
  curl_easy_setopt(curl, CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(bytes - from));
  curl_easy_setopt(curl, CURLOPT_READFUNCTION, &read_file_chunk);
  curl_easy_setopt(curl, CURLOPT_READDATA, source.get());
  return perform(path, list, nullptr);
}

Result<HttpResponse> HttpClient::upload(const std::string& path, const fs::path& file,
                                        std::optional<std::uint64_t> offset) {
  return state_->send(path, file, "application/octet-stream", offset);
}

Result<HttpResponse> HttpClient::post_file(const std::string& path, const fs::path& file,
                                           std::string_view content_type) {
  curl_easy_setopt(state_->curl, CURLOPT_CUSTOMREQUEST, "POST");
  state_->stall_seconds = kWorkSeconds;
  auto response = state_->send(path, file, content_type);
  state_->stall_seconds = kStallSeconds;
  curl_easy_reset(state_->curl);  // removes CUSTOMREQUEST if send() failed before perform()
  return response;
}

Result<HttpResponse> HttpClient::download(const std::string& path, const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  const bool straight = fs::exists(status) && !fs::is_regular_file(status);
  const fs::path aside = straight ? file : fs::path(file.string() + ".part");
  FilePtr target(std::fopen(aside.c_str(), "wbe"));
  if (!target) return fail(Errc::unavailable, fmt::format("{} cannot be written", aside.string()));
  auto response = state_->perform(path, state_->headers(), target.get());
  const bool closed = std::fclose(target.release()) == 0;
  error.clear();
  if (response && response->status / 100 == 2 && closed) {
    if (!straight) fs::rename(aside, file, error);
    if (!error) return response;
  }
  std::error_code ignored;
  if (!straight) fs::remove(aside, ignored);
  if (!response || response->status / 100 != 2) return response;
  return fail(Errc::resource_exhausted,
              fmt::format("{} cannot be written{}", file.string(), error ? ": " + error.message() : ""));
}

bool RetryPolicy::again(const Error& error) {
  if (error.code != Errc::unavailable || seconds(clock_.now() - last_answer_) > kRemoteSeconds) return false;
  pause_milliseconds_ =
      std::clamp(2 * pause_milliseconds_, kFirstPauseMilliseconds, kLongestPauseMilliseconds);
  ::poll(nullptr, 0, pause_milliseconds_);
  return true;
}

void RetryPolicy::answered() {
  last_answer_ = clock_.now();
  pause_milliseconds_ = 0;
}

}  // namespace ls::cli
