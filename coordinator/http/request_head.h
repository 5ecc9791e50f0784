// What Beast makes of a connection's bytes, and our own values out of that: the part of reading a request
// that needs no socket. Includes Boost: only the server loop's own files (and their fuzzer) include this.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstddef>
#include <string>
#include <variant>

#include "coordinator/http/limits.h"
#include "coordinator/http/message.h"

namespace ls::http {

namespace beast = boost::beast;
using Parser = beast::http::request_parser<beast::http::buffer_body>;

// Sets the bounds of a fresh parser.
void prepare(Parser& parser, const Limits& limits);

enum class Parsed { more, done, malformed, too_large };
// Takes what the buffer holds of the header. `more`: all of it was taken (or is too little), the header has
// not ended.
Parsed take_header(Parser& parser, beast::flat_buffer& buffer);

// What was parsed as our own value, without the body; or the answer to a header that is no request of ours.
std::variant<Response, Request> to_request(const Parser& parser);

struct Portion {
  std::size_t consumed = 0;  // bytes of the buffer: the body's own, and those of a chunk's header
  std::size_t got = 0;       // bytes that `into` grew by
  bool malformed = false;
};
// Takes what the buffer holds of the body.
Portion take_body(Parser& parser, beast::flat_buffer& buffer, std::string& into);

}  // namespace ls::http
