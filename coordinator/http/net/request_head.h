// Parses the bytes of a request with Boost.Beast and converts the result to our own types. This part of
// reading a request needs no socket. Includes Boost: only the files of the server loop (and their fuzzer) may
// include this header.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/buffer_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstddef>
#include <string>
#include <variant>

#include "coordinator/http/message/limits.h"
#include "coordinator/http/message/message.h"

namespace ls::http {

namespace beast = boost::beast;
using Parser = beast::http::request_parser<beast::http::buffer_body>;

// Sets the limits of a fresh parser.
void prepare(Parser& parser, const Limits& limits);

enum class Parsed { more, done, malformed, too_large };
// Parses the part of the header that the buffer holds. `more`: the header has not ended; the buffer's bytes
// were consumed, or are too few to be parsed and stay in the buffer.
Parsed take_header(Parser& parser, beast::flat_buffer& buffer);

// Converts the parsed header to a Request without a body. Returns a response instead if the header is
// invalid.
std::variant<Response, Request> to_request(const Parser& parser);

struct Portion {
  std::size_t consumed = 0;  // bytes of the buffer, including chunk headers
  std::size_t got = 0;       // bytes that `into` grew by
  bool malformed = false;
};
// Takes the part of the body in the buffer and appends it to `into`.
Portion take_body(Parser& parser, beast::flat_buffer& buffer, std::string& into);

}  // namespace ls::http
