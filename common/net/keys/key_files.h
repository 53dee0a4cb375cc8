// The files of a folder of keys, as programs read them: NAME.key (secret), server.pub, allowed.toml. `telesplat keys`
// makes them (key_maker.h).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/allow_list.h"

namespace telesplat::net {

// CURVE keys as text: Z85, 40 characters.

struct KeyPair {
  std::string open;    ///< the public key, by which others know its owner
  std::string secret;  ///< only its owner has it
};

KeyPair make_key_pair();

/// True if `text` is a key of 32 bytes.
bool is_key(std::string_view text);
/// Returns the 32 bytes of a key. Precondition: is_key(text).
std::string key_bytes(std::string_view text);
/// Returns the public key of a secret one. Precondition: is_key(secret).
std::string public_of(const std::string& secret);

inline constexpr std::string_view kSecretEnd = ".key";
inline constexpr const char* kServerFile = "server.key";
inline constexpr const char* kServerPublicFile = "server.pub";
inline constexpr const char* kAllowedFile = "allowed.toml";

/// Content of a secret file.
struct NamedKey {
  std::string name;
  Role role = Role::kViewer;
  KeyPair pair;
};
/// The content of its file.
std::string text_of(const NamedKey& key);
/// Error: no TOML, something is missing, or the two keys do not belong together.
Result<NamedKey> parse_named_key(std::string_view text);

/// Permissions that a file must have.
enum class Privacy {
  kSecret,  ///< only its owner may read it
  kOpen     ///< all users may read it; only its owner may write
};
/// Reads a file of a folder of keys. Error, naming it: it cannot be read, is no plain file, is too large, belongs to
/// another user than this one or root, or its permissions break `privacy`.
Result<std::string> read_key_file(const std::string& path, Privacy privacy);

/// Reads the secret file FOLDER/NAME.key.
Result<NamedKey> read_named_key(const std::string& folder, std::string_view name);
/// The names NAME of the files NAME.key, sorted, at most AllowList::kMost.
std::vector<std::string> key_names(const std::string& folder);
/// Error: it is no folder, belongs to another user than this one or root, or others may write into it.
Status check_key_folder(const std::string& folder);
Result<AllowList> read_allow_list(const std::string& folder);

/// The keys of one process.
struct Keys {
  std::string folder;
  std::string server;           ///< the public key of the sockets that bind
  std::string server_secret;    ///< empty: this process can bind nothing
  std::optional<NamedKey> own;  ///< key to connect with; nothing: the process cannot connect
};

/// Reads the keys that a process needs. roles: those it may connect as, the preferred one first; of one role, a key of
/// the role's own name comes before persons' keys. binds: it needs the server's secret and the allow-list. Error: names
/// the folder or file, and what is missing or wrong.
Result<Keys> read_keys(const std::string& folder, const std::vector<Role>& roles, bool binds);

}  // namespace telesplat::net
