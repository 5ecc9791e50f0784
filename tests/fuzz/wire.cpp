// Bytes of a client's connection to the coordinator: what Beast makes of them, what we make of that, and
// bodies of a length and in chunks, until the connection would be closed. The first byte of each part of the
// input says how many bytes arrive at once.
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/http/read.hpp>

#include "coordinator/http/net/request_head.h"
#include "tests/fuzz/all_targets.h"
#include "tests/fuzz/http_coordinator.h"

namespace ls::fuzz {
namespace {

using namespace ls::http;

namespace bhttp = beast::http;
using boost::system::error_code;

// What arrives, some bytes at a time, as a stream that Beast reads.
class Arriving {
 public:
  Arriving(std::string_view bytes, std::size_t at_once) : rest_(bytes), at_once_(at_once) {}

  template <class Buffers>
  std::size_t read_some(const Buffers& into, error_code& ec) {
    const boost::asio::const_buffer next(rest_.data(), std::min(at_once_, rest_.size()));
    const std::size_t n = boost::asio::buffer_copy(into, next);
    rest_.remove_prefix(n);
    ec = n > 0 ? error_code() : boost::asio::error::eof;
    return n;
  }
  template <class Buffers>
  std::size_t read_some(const Buffers& into) {
    error_code ignored;
    return read_some(into, ignored);
  }
  beast::flat_buffer buffer{kReadBuffer};

 private:
  std::string_view rest_;
  std::size_t at_once_;
};

bool read_body(Parser& parser, Arriving& from, std::string& body) {
  while (!parser.is_done()) {
    error_code ec;
    bhttp::read_some(from, from.buffer, parser, ec);
    if (read_result(ec, false) != Read::ok) return false;
  }
  body = beast::buffers_to_string(parser.get().body().data());
  return true;
}

// False: the connection is closed.
bool serve_one(HttpCoordinator& coordinator, Arriving& from) {
  Parser parser;
  prepare(parser, coordinator.api().limits());
  error_code ec;
  bhttp::read_header(from, from.buffer, parser, ec);
  if (read_result(ec, false) != Read::ok) return false;
  auto parsed = to_request(parser);
  if (const auto* refused = std::get_if<Response>(&parsed)) {
    coordinator.check(*refused, Method::get);
    return false;
  }
  Request& request = std::get<Request>(parsed);
  if (request.has_body && !read_body(parser, from, request.body)) return false;
  must(!request.content_length || request.body.size() == *request.content_length || !request.has_body,
       "a body is as long as it was announced");
  if (!coordinator.small()) return false;
  coordinator.ask(request);
  return parser.keep_alive();
}

}  // namespace

void wire(Bytes input) {
  HttpCoordinator coordinator;
  for (const Bytes part : parts_of(input, 4)) {
    if (part.empty()) continue;
    const std::string bytes = coordinator.with_job(text_of(part.subspan(1)));
    Arriving from(bytes, part[0] == 0 ? bytes.size() : part[0]);
    for (int request = 0; request < 8 && serve_one(coordinator, from); ++request) {
    }
  }
}

Seeds wire_seeds() {
  const std::string common =
      std::string("Host: a\r\nAuthorization: Bearer ") + HttpCoordinator::kToken + "\r\n";
  const std::string scene =
      R"(<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="4"/></film></sensor><shape type="sphere"/><emitter type="constant"/></scene>)";
  const auto with_body = [&](const std::string& line, const std::string& type, const std::string& body) {
    return line + " HTTP/1.1\r\n" + common + "Content-Type: " + type +
           "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  };
  const std::string submit =
      with_body("POST /api/v1/jobs?spp=4&size=8x4&name=s.xml", "application/xml", scene);
  const auto get = [&](const std::string& what) { return "GET " + what + " HTTP/1.1\r\n" + common + "\r\n"; };
  Seeds seeds;
  for (const char pace : {'\0', '\7'}) {
    const std::string first = pace + submit;
    seeds.push_back(first + get("/api/v1/jobs") + get("/metrics"));
    seeds.push_back(with_length(first) + pace + get("/api/v1/jobs/JOB/report") +
                    with_body("PATCH /api/v1/jobs/JOB", "application/json", R"({"priority":3,"spp":64})"));
    seeds.push_back(std::string(1, pace) + "POST /api/v1/jobs?spp=4 HTTP/1.1\r\n" + common +
                    "Content-Type: application/xml\r\nTransfer-Encoding: "
                    "chunked\r\n\r\n5;a=b\r\n<scen\r\n9\r\ne></scene\r\n1\r\n>\r\n0\r\nX: y\r\n\r\n" +
                    get("/healthz"));
    seeds.push_back(std::string(1, pace) + "PUT /api/v1/blobs/" + sha256("blob").hex() + " HTTP/1.1\r\n" +
                    common + "Expect: 100-continue\r\nContent-Length: 4\r\n\r\nblob" +
                    get("/api/v1/blobs/" + sha256("blob").hex()));
    seeds.push_back(std::string(1, pace) + "OPTIONS * HTTP/1.1\r\nHost: a\r\n\r\n");
    seeds.push_back(std::string(1, pace) +
                    "GET http://a/api/v1/jobs?x=%41+b&y HTTP/1.0\r\nCookie: "
                    "lightshaft_session=x\r\nConnection: keep-alive\r\n\r\n");
  }
  return seeds;
}

}  // namespace ls::fuzz
