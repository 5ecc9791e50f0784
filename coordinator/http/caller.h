// Who asks, and what a role may do. The whole of it as a table: docs/reference/authorisation.md.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace ls::http {

enum class Role {
  admin,   // everything
  submit,  // hands in jobs; sees and changes its own, and sees no others
  read,    // sees everything, changes nothing
  join,    // a worker: joins over gRPC, and may do nothing here
};
std::string_view to_string(Role role);  // "admin" ...
std::optional<Role> parse_role(std::string_view name);

struct Caller {
  Role role = Role::join;  // the least, until somebody is known
  std::string user;        // owner of the jobs it hands in; empty: the admin of the file `token`
  std::string token_id;
  bool sees(std::string_view owner) const {
    return role == Role::admin || role == Role::read || (role == Role::submit && owner == user);
  }
};

}  // namespace ls::http
