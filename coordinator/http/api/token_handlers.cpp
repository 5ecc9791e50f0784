// Tokens, for the administrator: created (and shown once), listed, revoked.
#include "coordinator/http/api/api.h"
#include "coordinator/http/api/handlers.h"
#include "coordinator/http/message/json_read.h"
#include "coordinator/http/message/problem.h"

namespace ls::http {
namespace {

nlohmann::ordered_json to_value(const TokenInfo& token) {
  return {
      {"id", token.id}, {"role", to_string(token.role)}, {"user", token.user}, {"of_file", token.of_file}};
}

}  // namespace

Response get_tokens(Api& api, const Request&, const Params&) {
  auto list = nlohmann::ordered_json::array();
  for (const TokenInfo& token : api.tokens().list()) list.push_back(to_value(token));
  return json_response(200, write_json({{"tokens", std::move(list)}}));
}

Response post_token(Api& api, const Request& request, const Params&) {
  const auto body = read_object(request.body, {"role", "user"});
  if (!body) return problem(body.error());
  const auto role = body->find("role");
  const auto known = role != body->end() && role->is_string()
                         ? parse_role(role->get_ref<const std::string&>())
                         : std::nullopt;
  if (!known) return problem(400, "'role' must be \"admin\", \"submit\", \"read\" or \"join\"");
  std::string user;
  if (const auto found = body->find("user"); found != body->end()) {
    if (!found->is_string()) return problem(400, "'user' must be a text");
    user = found->get<std::string>();
  }
  const auto made = api.tokens().add(*known, std::move(user));
  if (!made) return problem(made.error());
  auto value = to_value(made->info);
  value["token"] = made->token;
  Response response = json_response(201, write_json(value));
  response.headers.emplace_back("Location", "/api/v1/tokens/" + made->info.id);
  return response;
}

Response delete_token(Api& api, const Request&, const Params& params) {
  if (const auto done = api.tokens().revoke(params[0]); !done) return problem(done.error());
  Response response;
  response.status = 204;
  return response;
}

}  // namespace ls::http
