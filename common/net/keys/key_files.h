// The files of a folder of keys, as programs that use them read them: NAME.key (secret), server.pub, allowed.toml.
// `telesplat keys` makes them (key_maker.h).
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
  std::string open;    ///< the public key: others know its owner by it
  std::string secret;  ///< only its owner has it
};

KeyPair make_key_pair();

/// Whether it is one of 32 bytes, as text.
bool is_key(std::string_view text);
/// The 32 bytes that it stands for; is_key(text) must be true.
std::string key_bytes(std::string_view text);
/// The public key that belongs to a secret one; is_key(secret) must be true.
std::string public_of(const std::string& secret);

inline constexpr std::string_view kSecretEnd = ".key";
inline constexpr const char* kServerFile = "server.key";
inline constexpr const char* kServerPublicFile = "server.pub";
inline constexpr const char* kAllowedFile = "allowed.toml";

/// What a secret file holds.
struct NamedKey {
  std::string name;
  Role role = Role::kViewer;
  KeyPair pair;
};
/// As the file has it.
std::string text_of(const NamedKey& key);
/// Error: no TOML, something is missing, or its keys do not belong together.
Result<NamedKey> parse_named_key(std::string_view text);

/// Who may look into a file.
enum class Privacy {
  kSecret,  ///< its owner alone
  kOpen     ///< everyone; nobody else may write
};
/// The text of a file of a folder of keys. Error, naming it: it cannot be read, is no plain file, is too large, belongs
/// to another person than this one or root, or others may do with it what they must not.
Result<std::string> read_key_file(const std::string& path, Privacy privacy);

/// The secret file FOLDER/NAME.key.
Result<NamedKey> read_named_key(const std::string& folder, std::string_view name);
/// The names NAME of the files NAME.key, sorted, at most as many as an allow-list has.
std::vector<std::string> key_names(const std::string& folder);
/// Error: it is no folder, belongs to another person than this one or root, or others may write into it.
Status check_key_folder(const std::string& folder);
Result<AllowList> read_allow_list(const std::string& folder);

/// The keys of one process.
struct Keys {
  std::string folder;
  std::string server;           ///< the public key of those who bind
  std::string server_secret;    ///< empty: this process can bind nothing
  std::optional<NamedKey> own;  ///< nothing: it can connect to nothing
};

/// Those that a process needs. roles: for what it may connect, the most wanted first; of one role a key of the role's
/// own name comes before persons' keys. binds: it needs the server's secret and the allow-list. Error: names the folder
/// or file, and what is missing in it or wrong with it.
Result<Keys> read_keys(const std::string& folder, const std::vector<Role>& roles, bool binds);

}  // namespace telesplat::net
