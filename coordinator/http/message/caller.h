// The caller of a request and its role. What each role may do: docs/reference/authorisation.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ls::http {

enum class Role {
  admin,   // everything
  submit,  // submits jobs; sees and changes only its own
  read,    // sees everything, changes nothing
  join,    // a worker: may join the farm over gRPC, but may not use the HTTP API
};
std::string_view to_string(Role role);  // "admin", ...
std::optional<Role> parse_role(std::string_view name);

struct Caller {
  Role role = Role::join;  // the least role, until the caller is identified
  std::string user;        // owner of the jobs it submits; empty: the administrator with the file `token`
  std::string token_id;
  // True if the caller may see the jobs of the user `owner`.
  bool sees(std::string_view owner) const {
    return role == Role::admin || role == Role::read || (role == Role::submit && owner == user);
  }
};

}  // namespace ls::http
