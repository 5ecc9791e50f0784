#include "util/http/post.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

namespace ls {
namespace {

struct FreeCurl {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
};
struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

struct AnswerBody {
  std::string text;
  std::size_t most = 0;
  bool longer = false;  // true: the answer has more than `most` bytes
};

// Ends the transfer, by not taking all bytes, once the answer is longer than what is kept of it.
std::size_t receive(char* data, std::size_t size, std::size_t count, void* to) {
  auto& body = *static_cast<AnswerBody*>(to);
  const std::size_t room = body.most - body.text.size();
  body.text.append(data, std::min(size * count, room));
  body.longer = size * count > room;
  return body.longer ? CURL_WRITEFUNC_ERROR : size * count;
}

int look_up(void* request, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<const HttpPost*>(request)->give_up() ? 1 : 0;
}

void start_curl() {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}

}  // namespace

Result<void> check_http_url(const std::string& url, std::string_view setting) {
  const bool http = url.starts_with("http://") || url.starts_with("https://");
  const bool clean =
      std::none_of(url.begin(), url.end(), [](unsigned char c) { return c <= ' ' || c == 0x7f; });
  if (http && clean && url.size() <= 2000) return {};
  return bad_argument(fmt::format(
      "{} '{}' is no address: http://HOST/PATH or https://HOST/PATH, without spaces", setting, url));
}

Result<HttpAnswer> post(const HttpPost& request) {
  start_curl();
  const std::unique_ptr<CURL, FreeCurl> curl(curl_easy_init());
  if (!curl) return fail(Errc::internal, "libcurl cannot be set up");
  std::unique_ptr<curl_slist, FreeList> headers;
  for (const auto& [name, value] : request.headers)
    headers.reset(curl_slist_append(headers.release(), fmt::format("{}: {}", name, value).c_str()));
  headers.reset(curl_slist_append(headers.release(), "Expect:"));
  AnswerBody body{{}, request.most_answer_bytes, false};

  CURL* c = curl.get();
  curl_easy_setopt(c, CURLOPT_URL, request.url.c_str());
  curl_easy_setopt(c, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(c, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(c, CURLOPT_PROXY, "");
  curl_easy_setopt(c, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(c, CURLOPT_TIMEOUT_MS, std::lround(request.seconds * 1000));
  curl_easy_setopt(c, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(c, CURLOPT_POSTFIELDS, request.body.data());
  curl_easy_setopt(c, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
  curl_easy_setopt(c, CURLOPT_WRITEFUNCTION, &receive);
  curl_easy_setopt(c, CURLOPT_WRITEDATA, &body);
  if (!request.ca_file.empty()) curl_easy_setopt(c, CURLOPT_CAINFO, request.ca_file.c_str());
  if (request.give_up) {
    curl_easy_setopt(c, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(c, CURLOPT_XFERINFOFUNCTION, &look_up);
    curl_easy_setopt(c, CURLOPT_XFERINFODATA, &request);
    // After give_up() has returned true, do not wait for a name server that hangs.
    curl_easy_setopt(c, CURLOPT_QUICK_EXIT, 1L);
  }
  if (const CURLcode code = curl_easy_perform(c); code != CURLE_OK && !body.longer)
    return fail(Errc::unavailable, curl_easy_strerror(code));
  long status = 0;
  curl_easy_getinfo(c, CURLINFO_RESPONSE_CODE, &status);
  return HttpAnswer{static_cast<int>(status), std::move(body.text)};
}

}  // namespace ls
