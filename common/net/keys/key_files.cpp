#include "common/net/keys/key_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <toml++/toml.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/core/check.h"
#include "common/core/descriptor.h"

namespace telesplat::net {

namespace {

namespace fs = std::filesystem;

constexpr mode_t kOthersWrite = S_IWGRP | S_IWOTH, kOthers = S_IRWXG | S_IRWXO;

Error key_file_failed(const std::string& path, const char* what) {
  return Error{fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

// Refuses a file of a stranger, who could change it at will.
Status check_owner(const std::string& path, const struct stat& about) {
  if (about.st_uid == geteuid() || about.st_uid == 0) return ok_status();
  return Error{fmt::format("{}: belongs to user {}, not to {} or root", path, about.st_uid, geteuid())};
}

std::string secret_path(const std::string& folder, std::string_view name) {
  return fmt::format("{}/{}{}", folder, name, kSecretEnd);
}

// Text that says how to get a missing file. A bundle, which was made from another folder, cannot be completed: no
// server lets in keys that are made in it.
std::string remedy(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::exists(fmt::format("{}/{}", folder, kServerFile), error) &&
      !key_names(folder).empty())
    return "who made this bundle can make another: telesplat keys FOLDER BUNDLE --bundle NAME";
  return fmt::format("telesplat keys {} makes keys", folder);
}

Result<std::string> read_server_public(const std::string& folder) {
  const std::string path = fmt::format("{}/{}", folder, kServerPublicFile);
  auto text = read_key_file(path, Privacy::kOpen);
  if (!text) return text.error();
  while (!text->empty() && std::isspace(static_cast<unsigned char>(text->back()))) text->pop_back();
  if (!is_key(*text)) return Error{fmt::format("{}: is no public key", path)};
  return text;
}

// Finds the key with which a process of one of these roles connects.
Result<NamedKey> own_key(const std::string& folder, const std::vector<Role>& roles) {
  const auto names = key_names(folder);
  std::vector<NamedKey> keys;
  std::vector<std::string> others;
  for (const std::string& name : names) {
    auto key = read_named_key(folder, name);
    if (!key) return key.error();
    if (std::ranges::find(roles, key->role) != roles.end())
      keys.push_back(*std::move(key));
    else if (key->role != Role::kServer)
      others.push_back(fmt::format("{} is {}'s", key->name, described(key->role)));
  }
  for (const Role role : roles) {
    const auto own = [&](const NamedKey& k) { return k.role == role && k.name == name_of(role); };
    auto found = std::ranges::find_if(keys, own);
    if (found == keys.end()) found = std::ranges::find(keys, role, &NamedKey::role);
    if (found != keys.end()) return std::move(*found);
  }
  std::string wanted = described(roles.front());
  for (size_t i = 1; i < roles.size(); ++i) wanted += " or " + described(roles[i]);
  return Error{fmt::format("{}: there is no key of {} ({}); {}", folder, wanted,
                           others.empty() ? "none at all" : fmt::format("{}", fmt::join(others, ", ")),
                           remedy(folder))};
}

}  // namespace

std::string text_of(const NamedKey& k) {
  return fmt::format(
      "# {} key of {} ({}). Whoever has this file is taken for its owner: keep it secret.\n"
      "name = \"{}\"\nrole = \"{}\"\npublic = \"{}\"\nsecret = \"{}\"\n",
      k.role == Role::kServer ? "The" : "A", k.name, name_of(k.role), k.name, name_of(k.role), k.pair.open,
      k.pair.secret);
}

Result<NamedKey> parse_named_key(std::string_view text) {
  try {
    const toml::table table = toml::parse(text);
    const auto at = [&](std::string_view key) { return table[key].value_or(std::string()); };
    NamedKey out{.name = at("name"), .pair = {at("public"), at("secret")}};
    if (const std::string why = complain_about_name(out.name); !why.empty()) return Error{"the name in it " + why};
    const auto role = role_named(at("role"));
    if (!role) return Error{fmt::format("\"{}\" is no role", at("role").substr(0, 40))};
    if (!is_key(out.pair.secret) || public_of(out.pair.secret) != out.pair.open)
      return Error{"its secret and its public key do not belong together"};
    out.role = *role;
    return out;
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("line {}: {}", e.source().begin.line, e.description())};
  }
}

Result<std::string> read_key_file(const std::string& path, Privacy privacy) {
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
  struct stat about {};
  if (file.get() < 0 || fstat(file.get(), &about) != 0) return key_file_failed(path, "cannot be read");
  if (!S_ISREG(about.st_mode)) return Error{fmt::format("{}: is no plain file", path)};
  if (const Status s = check_owner(path, about); !s) return s.error();
  if (privacy == Privacy::kSecret && (about.st_mode & kOthers))
    return Error{fmt::format("{}: others may read this secret key (mode {:03o}); chmod 600 keeps it to yourself", path,
                             about.st_mode & 0777)};
  if (about.st_mode & kOthersWrite)
    return Error{fmt::format("{}: others may write into it (mode {:03o}); chmod go-w", path, about.st_mode & 0777)};
  std::string out;
  for (char buffer[4096];;) {
    const ssize_t n = ::read(file.get(), buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return key_file_failed(path, "cannot be read");
    if (n == 0) return out;
    if (out.size() + size_t(n) > AllowList::kMostBytes)
      return Error{fmt::format("{}: has more than {} bytes", path, AllowList::kMostBytes)};
    out.append(buffer, size_t(n));
  }
}

Result<NamedKey> read_named_key(const std::string& folder, std::string_view name) {
  const std::string path = secret_path(folder, name);
  const auto text = read_key_file(path, Privacy::kSecret);
  if (!text) return text.error();
  auto key = parse_named_key(*text);
  if (!key) return Error{fmt::format("{}: {}", path, key.error().text)};
  if (key->name != name) return Error{fmt::format("{}: is the key of {}", path, key->name)};
  return key;
}

std::vector<std::string> key_names(const std::string& folder) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string file = entry.path().filename().string();
    if (file.starts_with('.') || !file.ends_with(kSecretEnd) || out.size() >= AllowList::kMost) continue;
    out.push_back(file.substr(0, file.size() - kSecretEnd.size()));
  }
  std::ranges::sort(out);
  return out;
}

Status check_key_folder(const std::string& folder) {
  const Descriptor opened{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  struct stat about {};
  if (opened.get() < 0 || fstat(opened.get(), &about) != 0)
    return Error{
        fmt::format("{}: cannot be opened as a folder of keys: {}; {}", folder, std::strerror(errno), remedy(folder))};
  if (about.st_mode & kOthersWrite)
    return Error{
        fmt::format("{}: others may write into this folder of keys (mode {:03o}); chmod 700 keeps it to "
                    "yourself",
                    folder, about.st_mode & 0777)};
  return check_owner(folder, about);
}

Result<AllowList> read_allow_list(const std::string& folder) {
  const std::string path = fmt::format("{}/{}", folder, kAllowedFile);
  const auto text = read_key_file(path, Privacy::kOpen);
  if (!text) return text.error();
  auto list = AllowList::parse(*text);
  if (!list) return Error{fmt::format("{}: {}", path, list.error().text)};
  return list;
}

Result<Keys> read_keys(const std::string& folder, const std::vector<Role>& roles, bool binds) {
  if (const Status s = check_key_folder(folder); !s) return s.error();
  Keys out{.folder = folder, .server = {}, .server_secret = {}, .own = {}};
  if (binds) {
    auto server = read_named_key(folder, name_of(Role::kServer));
    if (!server) return server.error();
    if (server->role != Role::kServer)
      return Error{fmt::format("{}/{}: is {}'s", folder, kServerFile, described(server->role))};
    if (const auto list = read_allow_list(folder); !list) return list.error();
    out.server_secret = server->pair.secret;
    out.server = server->pair.open;
  } else {
    auto server = read_server_public(folder);
    if (!server) return server.error();
    out.server = *std::move(server);
  }
  if (roles.empty()) return out;
  auto own = own_key(folder, roles);
  if (!own) return own.error();
  out.own = *std::move(own);
  return out;
}

namespace {
constexpr size_t kBytes = 32, kCharacters = 40;
using Text = std::array<char, kCharacters + 1>;  // with the zero byte at its end
}  // namespace

KeyPair make_key_pair() {
  Text open{}, secret{};
  CHECK(zmq_curve_keypair(open.data(), secret.data()) == 0);  // ZeroMQ of Debian has CURVE
  return {open.data(), secret.data()};
}

bool is_key(std::string_view text) {
  std::array<unsigned char, kBytes> bytes{};
  // Checks for zero bytes first: ZeroMQ's decoder stops at one.
  return text.size() == kCharacters && text.find('\0') == text.npos &&
         zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

std::string key_bytes(std::string_view text) {
  std::array<unsigned char, kBytes> bytes{};
  CHECK(text.size() == kCharacters && zmq_z85_decode(bytes.data(), std::string(text).c_str()));
  return {bytes.begin(), bytes.end()};
}

std::string public_of(const std::string& secret) {
  Text open{};
  CHECK(is_key(secret) && zmq_curve_public(open.data(), secret.c_str()) == 0);
  return open.data();
}

}  // namespace telesplat::net
