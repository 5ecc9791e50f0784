#include "coordinator/store/blobs/s3_link.h"

#include <curl/curl.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <strings.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <mutex>

#include "coordinator/store/files.h"
#include "core/base/log.h"
#include "core/base/safe_text.h"

namespace ls::coordinator {
namespace {

constexpr long kConnectSeconds = 10;
constexpr long kStallSeconds = 30;  // a transfer that moves no byte for this long is aborted
constexpr long kAnswerSeconds = 5;  // the store counts as unavailable if answers() takes longer
// Greatest size, in bytes, of an answer that is a list or an error
constexpr std::size_t kMaxText = 8u << 20;
constexpr std::size_t kShownText = 300;       // a message quotes at most this many bytes of such an answer
constexpr std::uint64_t kMostParts = 10'000;  // the protocol's limit on the parts of an object
constexpr std::uint64_t kChunk = 1u << 20;    // a part is hashed in chunks of this many bytes
// SHA-256 of an empty payload
constexpr const char* kNoBytes = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
constexpr std::size_t kMaxListed = 10'000'000;  // list() requests no more keys once it has this many

using InputFile = std::unique_ptr<std::FILE, decltype([](std::FILE* file) { std::fclose(file); })>;
using Headers = std::unique_ptr<curl_slist, decltype([](curl_slist* list) { curl_slist_free_all(list); })>;
using Transfer = std::unique_ptr<CURL, decltype([](CURL* curl) { curl_easy_cleanup(curl); })>;

// The part of a file that a request still has to send; it begins at the file's current position.
struct Source {
  std::FILE* file;
  std::uint64_t left;

  static std::size_t send(char* data, std::size_t size, std::size_t count, void* pointer) {
    auto& self = *static_cast<Source*>(pointer);
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(size * count, self.left));
    const std::size_t bytes = std::fread(data, 1, wanted, self.file);
    self.left -= bytes;
    return bytes;
  }
};

bool may_pass(int status) { return status == 0 || status == 429 || status >= 500; }

// Returns the text of the first XML element with this name at or after position *at, and sets *at to the end
// of that element. If there is none, returns an empty text and sets *at to npos. Understands just enough XML
// for the answers of S3.
std::string xml_element(std::string_view xml, std::string_view name, std::size_t* at = nullptr) {
  const std::string open = fmt::format("<{}>", name), close = fmt::format("</{}>", name);
  const std::size_t begin = xml.find(open, at ? *at : 0);
  const std::size_t end = begin == std::string_view::npos ? begin : xml.find(close, begin);
  if (at) *at = end;
  return end == std::string_view::npos
             ? ""
             : std::string(xml.substr(begin + open.size(), end - begin - open.size()));
}

struct Receiver {
  CURL* curl;
  const S3Link::Sink* sink;
  std::string* text;
  std::optional<Error>* refused;

  static std::size_t receive(char* data, std::size_t size, std::size_t count, void* pointer) {
    auto& self = *static_cast<Receiver*>(pointer);
    const std::size_t bytes = size * count;
    long status = 0;
    curl_easy_getinfo(self.curl, CURLINFO_RESPONSE_CODE, &status);
    if (self.sink && status / 100 == 2) {
      const auto taken = (*self.sink)(std::as_bytes(std::span(data, bytes)));
      if (!taken) *self.refused = taken.error();
      return taken ? bytes : 0;
    }
    if (self.text->size() + bytes > kMaxText) return 0;
    self.text->append(data, bytes);
    return bytes;
  }
};

std::size_t receive_header(char* data, std::size_t size, std::size_t count, void* etag) {
  constexpr std::string_view kName = "etag:";
  const std::string_view line(data, size * count);
  if (line.size() > kName.size() && ::strncasecmp(line.data(), kName.data(), kName.size()) == 0) {
    const std::size_t begin = line.find_first_not_of(" \t", kName.size()),
                      end = line.find_last_not_of(" \t\r\n");
    if (begin <= end && end != std::string_view::npos)
      *static_cast<std::string*>(etag) = line.substr(begin, end + 1 - begin);
  }
  return line.size();
}

Result<Digest> digest_of(const std::filesystem::path& path, std::uint64_t offset, std::uint64_t bytes) {
  auto file = File::open(path, O_RDONLY);
  if (!file) return tl::unexpected(file.error());
  Sha256 hash;
  for (const std::uint64_t end = offset + bytes; offset < end; offset += kChunk) {
    const auto chunk = read_at(*file, offset, static_cast<std::size_t>(std::min(kChunk, end - offset)), path);
    if (!chunk) return tl::unexpected(chunk.error());
    hash.update(*chunk);
  }
  return hash.finish();
}

}  // namespace

struct S3Link::Request {
  const char* method = "GET";
  std::string key;    // key of the object; empty: the request concerns the bucket
  std::string query;  // parameters NAME=VALUE, sorted by name and escaped, as the signature needs them
  std::filesystem::path file = {};  // for PUT: the payload is `bytes` bytes of this file from `offset` on
  std::uint64_t offset = 0, bytes = 0;
  std::string body = {};           // payload of a POST request
  std::string payload = kNoBytes;  // SHA-256 of the payload
  long most_seconds = 0;           // time limit for the request; 0: none, as long as bytes arrive
  const Sink* sink = nullptr;
  const std::function<Result<void>()>* restart = nullptr;
};
struct S3Link::Answer {
  int status = 0;  // HTTP status; 0: no answer came
  std::uint64_t length = 0;
  std::string etag;
  std::string text;  // the body, unless it was passed to a sink; if there is no answer, the reason
  std::optional<Error> refused;  // the sink's error, which ended the request
};

S3Link::S3Link(S3Options options) : options_(std::move(options)) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}

std::string S3Link::url_of(const Request& request) const {
  const S3Address& a = options_.address;
  std::string url = a.endpoint + "/" + a.bucket;
  if (!request.key.empty()) url += (a.prefix.empty() ? "/" : "/" + a.prefix + "/") + request.key;
  return request.query.empty() ? url : url + "?" + request.query;
}

Result<S3Link::Answer> S3Link::ask_once(const Request& request) const {
  const Transfer curl(curl_easy_init());
  if (!curl) return fail(Errc::internal, "libcurl cannot be started");
  Headers headers;
  const auto add = [&](const std::string& line) {
    headers.reset(curl_slist_append(headers.release(), line.c_str()));
  };
  add("x-amz-content-sha256: " + request.payload);
  if (!options_.keys.session.empty()) add("x-amz-security-token: " + options_.keys.session);
  Answer answer;
  Receiver receiver{curl.get(), request.sink, &answer.text, &answer.refused};
  char problem[CURL_ERROR_SIZE] = "";
  InputFile file;
  Source source{nullptr, request.bytes};
  const std::string verb = request.method;
  if (verb == "HEAD") curl_easy_setopt(curl.get(), CURLOPT_NOBODY, 1L);
  if (verb == "DELETE") curl_easy_setopt(curl.get(), CURLOPT_CUSTOMREQUEST, "DELETE");
  if (verb == "PUT") {
    file.reset(std::fopen(request.file.c_str(), "rbe"));
    if (!file || ::fseeko(file.get(), static_cast<off_t>(request.offset), SEEK_SET) != 0)
      return fail(Errc::not_found, fmt::format("{} cannot be read", request.file.string()));
    source.file = file.get();
    add("Content-Type: application/octet-stream");
    curl_easy_setopt(curl.get(), CURLOPT_UPLOAD, 1L);
    curl_easy_setopt(curl.get(), CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(request.bytes));
    curl_easy_setopt(curl.get(), CURLOPT_READFUNCTION, &Source::send);
    curl_easy_setopt(curl.get(), CURLOPT_READDATA, &source);
  }
  if (verb == "POST") {
    add("Content-Type: application/xml");
    curl_easy_setopt(curl.get(), CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
    curl_easy_setopt(curl.get(), CURLOPT_POSTFIELDS, request.body.c_str());
  }
  const std::string url = url_of(request), login = options_.keys.id + ":" + options_.keys.secret;
  curl_easy_setopt(curl.get(), CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_USERPWD, login.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_AWS_SIGV4, ("aws:amz:" + options_.address.region + ":s3").c_str());
  curl_easy_setopt(curl.get(), CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl.get(), CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT, request.most_seconds);
  curl_easy_setopt(curl.get(), CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_LOW_SPEED_TIME, kStallSeconds);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, &Receiver::receive);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &receiver);
  curl_easy_setopt(curl.get(), CURLOPT_HEADERFUNCTION, &receive_header);
  curl_easy_setopt(curl.get(), CURLOPT_HEADERDATA, &answer.etag);
  curl_easy_setopt(curl.get(), CURLOPT_ERRORBUFFER, problem);
  const CURLcode code = curl_easy_perform(curl.get());
  long status = 0;
  curl_off_t length = 0;
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &status);
  curl_easy_getinfo(curl.get(), CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  answer.length = length < 0 ? 0 : static_cast<std::uint64_t>(length);
  const bool has_status = code == CURLE_OK || (code == CURLE_SEND_ERROR && status >= 400);
  answer.status = has_status ? static_cast<int>(status) : 0;
  if (!has_status) answer.text = *problem ? problem : curl_easy_strerror(code);
  return answer;
}

Result<S3Link::Answer> S3Link::ask(const Request& request) const {
  Duration pause = options_.first_pause;
  for (int attempt = 1;; ++attempt) {
    if (request.restart)
      if (auto ready = (*request.restart)(); !ready) return tl::unexpected(ready.error());
    auto answer = ask_once(request);
    if (!answer) return answer;
    if (answer->refused) return tl::unexpected(*answer->refused);
    if (!may_pass(answer->status)) return answer;
    if (attempt == options_.attempts) return tl::unexpected(error_of(request, *answer));
    log_warn("store=s3", error_of(request, *answer).message + "; it is tried again");
    ::poll(nullptr, 0,
           static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(pause).count()));
    pause = std::min(pause * 2, options_.longest_pause);
  }
}

Result<S3Link::Answer> S3Link::ask_for(const Request& request) const {
  const std::string_view method = request.method;
  const bool reads = method == "GET" || method == "HEAD";
  auto answer = ask(request);
  if (answer && (reads ? answer->status != 200 : answer->status / 100 != 2))
    return tl::unexpected(error_of(request, *answer));
  return answer;
}

Error S3Link::error_of(const Request& request, const Answer& answer) const {
  const std::string what = fmt::format("{} {}", request.method, url_of(request));
  if (answer.status == 0) return {Errc::unavailable, fmt::format("{}: no answer: {}", what, answer.text)};
  const std::string code = xml_element(answer.text, "Code"), text = xml_element(answer.text, "Message");
  const std::string answered = fmt::format("{}: status {} {} {}", what, answer.status, code,
                                           text.empty() ? answer.text.substr(0, kShownText) : text);
  if (answer.status == 404 && code == "NoSuchBucket")
    return {Errc::failed_precondition, answered + "; make the bucket first, or correct --blobs"};
  if (answer.status == 404) return {Errc::not_found, answered};
  if (answer.status == 401 || answer.status == 403)
    return {Errc::permission_denied,
            answered +
                "; check AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, what they allow, the region and this "
                "machine's clock"};
  if (answer.status == 507) return {Errc::resource_exhausted, answered};
  return {may_pass(answer.status) ? Errc::unavailable : Errc::internal, answered};
}

// Requests an object that does not exist: the answer 404 shows that the store is available.
Result<void> S3Link::answers() const {
  const Request request{.method = "HEAD", .key = "answers", .most_seconds = kAnswerSeconds};
  const auto answer = ask_once(request);
  if (!answer) return tl::unexpected(answer.error());
  if (answer->status != 200 && answer->status != 404) return tl::unexpected(error_of(request, *answer));
  return {};
}

Result<S3Link::Object> S3Link::look_at(const std::string& key) const {
  const auto answer = ask_for({.method = "HEAD", .key = key});
  if (!answer) return tl::unexpected(answer.error());
  return Object{answer->length, answer->etag};
}

Result<void> S3Link::get(const std::string& key, const std::function<Result<void>()>& restart,
                         const Sink& sink) const {
  return ask_for({.key = key, .sink = &sink, .restart = &restart}).map([](const Answer&) {});
}

Result<void> S3Link::put(const std::string& key, const std::filesystem::path& file, std::uint64_t bytes,
                         const Digest& digest) const {
  if (bytes > options_.address.part_bytes) return put_parts(key, file, bytes);
  return ask_for({.method = "PUT", .key = key, .file = file, .bytes = bytes, .payload = digest.hex()})
      .map([](const Answer&) {});
}

Result<void> S3Link::put_parts(const std::string& key, const std::filesystem::path& file,
                               std::uint64_t bytes) const {
  auto upload = begin_parts(key);
  if (!upload) return tl::unexpected(upload.error());
  auto done = send_parts(key, *upload, file, bytes);
  if (done) return done;
  // The upload failed, so the parts that were sent are removed. Otherwise the store would keep them: they are
  // not listed as objects, but the operator pays for them.
  if (const auto gone = remove(key, "uploadId=" + percent_encode(*upload)); !gone)
    log_warn("store=s3", fmt::format("the parts of {} that were sent stay in {}: {}", key, shown(),
                                     gone.error().message));
  return done;
}

Result<std::string> S3Link::begin_parts(const std::string& key) const {
  const Request request{.method = "POST", .key = key, .query = "uploads="};
  const auto answer = ask_for(request);
  if (!answer) return tl::unexpected(answer.error());
  const std::string id = xml_element(answer->text, "UploadId");
  if (id.empty()) return tl::unexpected(error_of(request, *answer));
  return id;
}

Result<void> S3Link::send_parts(const std::string& key, const std::string& upload,
                                const std::filesystem::path& file, std::uint64_t bytes) const {
  const std::uint64_t part_bytes =
      std::max(options_.address.part_bytes, (bytes + kMostParts - 1) / kMostParts);
  Request end{.method = "POST",
              .key = key,
              .query = "uploadId=" + percent_encode(upload),
              .body = "<CompleteMultipartUpload>"};
  int number = 1;
  for (std::uint64_t offset = 0; offset < bytes; offset += part_bytes, ++number) {
    Request part{.method = "PUT",
                 .key = key,
                 .query = fmt::format("partNumber={}&uploadId={}", number, percent_encode(upload)),
                 .file = file,
                 .offset = offset,
                 .bytes = std::min(part_bytes, bytes - offset)};
    const auto digest = digest_of(file, offset, part.bytes);
    if (!digest) return tl::unexpected(digest.error());
    part.payload = digest->hex();
    const auto answer = ask_for(part);
    if (!answer) return tl::unexpected(answer.error());
    if (answer->etag.empty()) return tl::unexpected(error_of(part, *answer));
    end.body += fmt::format("<Part><PartNumber>{}</PartNumber><ETag>{}</ETag></Part>", number, answer->etag);
  }
  end.body += "</CompleteMultipartUpload>";
  end.payload = sha256(end.body).hex();
  const auto answer = ask(end);
  if (!answer) return tl::unexpected(answer.error());
  // The store begins its answer before it has joined the parts, so an answer with status 200 may contain an
  // error.
  if (answer->status / 100 == 2 && xml_element(answer->text, "Code").empty()) return {};
  // An earlier attempt may have completed the upload although its answer was lost. Then the store no longer
  // knows the upload's id, but the object exists. After any other error, an existing object proves nothing,
  // since it may be older than this upload.
  if (xml_element(answer->text, "Code") == "NoSuchUpload")
    if (const auto there = look_at(key); there && there->bytes == bytes) return {};
  return tl::unexpected(error_of(end, *answer));
}

Result<void> S3Link::remove(const std::string& key, const std::string& query) const {
  const Request request{.method = "DELETE", .key = key, .query = query};
  const auto answer = ask(request);
  if (!answer) return tl::unexpected(answer.error());
  if (answer->status / 100 != 2 && answer->status != 404) return tl::unexpected(error_of(request, *answer));
  return {};
}

Result<std::vector<std::string>> S3Link::list() const {
  const std::string prefix = options_.address.prefix.empty() ? "" : options_.address.prefix + "/";
  std::vector<std::string> keys;
  for (std::string token; keys.size() < kMaxListed;) {
    Request request;
    if (!token.empty()) request.query = "continuation-token=" + percent_encode(token) + "&";
    request.query += "list-type=2&prefix=" + percent_encode(prefix);
    const auto answer = ask_for(request);
    if (!answer) return tl::unexpected(answer.error());
    for (std::size_t at = 0;;) {
      const std::string key = xml_element(answer->text, "Key", &at);
      if (at == std::string::npos) break;
      if (key.starts_with(prefix)) keys.push_back(key.substr(prefix.size()));
    }
    token = xml_element(answer->text, "NextContinuationToken");
    if (token.empty()) break;
  }
  return keys;
}

}  // namespace ls::coordinator
