// Who may do what: the roles that keys have, and the one table that binds them to sockets and messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace telesplat::net {

/// What a key is for. kServer: the key of those who bind, which also asks for a status.
enum class Role : uint8_t { kServer, kData, kPacker, kSampler, kViewer, kOperator };
inline constexpr Role kRoles[] = {Role::kServer,  Role::kData,   Role::kPacker,
                                  Role::kSampler, Role::kViewer, Role::kOperator};

/// "server", "data", "packer", "sampler", "viewer", "operator".
std::string_view name_of(Role role);
std::optional<Role> role_named(std::string_view name);
/// With its article: "a sampler", "an operator".
std::string described(Role role);

/// Whether keys of this role are let in at a socket ("control", "chunks", "voxels", "tiles", "patches", "state"): there
/// is something that they may send.
bool may_connect(Role role, std::string_view socket);
/// Whether they may send a message of this type there.
bool may_send(Role role, std::string_view socket, std::string_view type);
/// Whether a process that says hello may have this role (wire::Hello::role).
bool may_be(Role role, std::string_view hello_role);
/// Whether they may give a master this command (wire::Control): whatever changes the session for others needs an
/// operator's key.
bool may_command(Role role, std::string_view command);

/// A word that a peer sent, for a log or an answer: 64 characters at most, and '?' for what is no letter, digit, '.',
/// '_' or '-'.
std::string as_word(std::string_view text);

/// Why a command was refused, for the person who gave it. user: the name of their key.
std::string refused_command(Role role, std::string_view user, std::string_view command);

}  // namespace telesplat::net
