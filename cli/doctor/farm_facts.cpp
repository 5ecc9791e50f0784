#include "cli/doctor/farm_facts.h"

#include <algorithm>

#include "cli/farm/farm_api.h"
#include "cli/output/reply_fields.h"
#include "common/base/clock.h"

namespace ls::cli {
namespace {

using nlohmann::json;

// Removes user and password: "https://user:password@host" becomes "https://host".
std::string without_password(const std::string& url) {
  const std::size_t start = url.find("://");
  const std::size_t host = start == std::string::npos ? 0 : start + 3;
  const std::size_t end = std::min(url.find('/', host), url.size());
  const std::size_t at = url.substr(0, end).rfind('@');
  return at == std::string::npos || at < host ? url : url.substr(0, host) + url.substr(at + 1);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

std::vector<WorkerFacts> workers_of(const json& answer) {
  std::vector<WorkerFacts> all;
  const auto list = answer.find("workers");
  if (list == answer.end() || !list->is_array()) return all;
  for (const json& w : *list)
    if (w.is_object())
      all.push_back({text_field(w, "name"), text_field(w, "state"), text_field(w, "activity"),
                     text_field(w, "build"), text_field(w, "numeric_class"), flag_field(w, "fake")});
  return all;
}

void ask_readiness(HttpClient& client, FarmFacts& facts) {
  const auto ready = client.request("GET", "/readyz");
  if (!ready) {
    facts.not_ready = ready.error().message;
  } else if (ready->status / 100 != 2) {
    facts.not_ready = problem_of(*ready).error.message;
  } else if (ready->body != "ready\n") {
    facts.remark = ready->body.substr(0, ready->body.find('\n'));
  }
}

void ask_session(HttpClient& client, FarmFacts& facts) {
  const auto session = client.request("GET", "/api/v1/session");
  if (!session) {
    facts.session_trouble = session.error().message;
    return;
  }
  facts.session_status = session->status;
  const json answer = json::parse(session->body, nullptr, false);
  if (session->status / 100 != 2 || !answer.is_object()) {
    facts.session_trouble = problem_of(*session).error.message;
    return;
  }
  facts.role = text_field(answer, "role");
  facts.user = text_field(answer, "user");
  facts.version = text_field(answer, "version");
  const auto workers = client.request("GET", "/api/v1/workers");
  if (!workers || workers->status / 100 != 2) return;
  if (const json list = json::parse(workers->body, nullptr, false); list.is_object())
    facts.workers = workers_of(list);
}

Result<FarmFacts> observe_one(const HttpClient::Options& connection) {
  auto client = HttpClient::open(connection);
  if (!client) return tl::unexpected(client.error());
  FarmFacts facts;
  facts.has_token = !connection.token.empty();
  facts.asked_at = system_unix_seconds();
  const auto health = client->request("GET", "/healthz");
  facts.answered_at = system_unix_seconds();
  if (!health) {
    facts.trouble = health.error().message;
    return facts;
  }
  facts.date = health->date;
  facts.is_coordinator = health->status == 200 && health->body == "ok\n";
  if (!facts.is_coordinator) return facts;
  ask_readiness(*client, facts);
  if (facts.has_token) ask_session(*client, facts);
  return facts;
}

}  // namespace

Result<std::vector<FarmFacts>> observe_farm(const HttpClient::Options& connection) {
  std::vector<FarmFacts> all;
  for (std::size_t at = 0; at <= connection.url.size();) {
    const std::size_t comma = std::min(connection.url.find(',', at), connection.url.size());
    HttpClient::Options one = connection;
    one.url = connection.url.substr(at, comma - at);
    while (one.url.ends_with('/')) one.url.pop_back();
    at = comma + 1;
    const std::string shown = without_password(one.url);
    auto facts = observe_one(one);
    if (!facts) return fail(facts.error().code, replaced(facts.error().message, one.url, shown));
    facts->url = shown;
    for (std::string* text : {&facts->trouble, &facts->not_ready, &facts->session_trouble})
      *text = replaced(*text, one.url, shown);
    all.push_back(std::move(*facts));
  }
  return all;
}

}  // namespace ls::cli
