// Permissions: the roles that keys have, and the one table that binds roles to sockets and messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace telesplat::net {

/// Purpose of a key. kServer: the key of processes that bind, which may also ask for a status.
enum class Role : uint8_t { kServer, kData, kPacker, kSampler, kViewer, kOperator };
inline constexpr Role kRoles[] = {Role::kServer,  Role::kData,   Role::kPacker,
                                  Role::kSampler, Role::kViewer, Role::kOperator};

/// "server", "data", "packer", "sampler", "viewer", "operator".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);
/// The name with its article: "a sampler", "an operator".
std::string described(Role role);

/// True if keys of this role are let in at a socket ("control", "chunks", "voxels", "tiles", "patches", "state"): some
/// message may be sent there.
bool may_connect(Role role, std::string_view socket);
/// True if this role may send a message of this type there.
bool may_send(Role role, std::string_view socket, std::string_view type);
/// True if a process with a key of this role may say hello as `hello_role` (wire::Hello::role).
bool may_be(Role role, std::string_view hello_role);
/// True if this role may give a master this command (wire::Control): commands that change the session for others need
/// an operator's key.
bool may_command(Role role, std::string_view command);

/// A word that a peer sent, for a log or an answer: 64 characters at most, and '?' for each that is no letter, digit,
/// '.', '_' or '-'.
std::string as_word(std::string_view text);

/// Text that explains to the sender why a command was refused. user: the name of the sender's key.
std::string refused_command(Role role, std::string_view user, std::string_view command);

}  // namespace telesplat::net
