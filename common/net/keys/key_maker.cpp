#include "common/net/keys/key_maker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <utility>

#include "common/net/keys/key_files.h"

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kLockPatience{5};  // another program holds the lock for milliseconds
constexpr std::string_view kMaster = "master";

std::string file_of(std::string_view name) { return fmt::format("{}{}", name, kSecretEnd); }

bool is_there(const std::string& folder, const std::string& name) {
  std::error_code error;
  return fs::symlink_status(folder + "/" + name, error).type() != fs::file_type::not_found;
}

// Refuses a folder that holds other files: keys do not belong among someone's documents.
Status refuse_strangers(const RuntimeFolder& folder) {
  if (is_there(folder.path(), kServerFile)) return ok_status();
  for (const std::string& name : folder.names())
    if (name != kAllowedFile && name != kServerPublicFile && !name.ends_with(kSecretEnd))
      return Error{fmt::format("{}: holds {}, and no keys; name a new folder", folder.path(), name)};
  return ok_status();
}

}  // namespace

Result<KeyMaker> KeyMaker::open(const std::string& path) {
  auto folder = RuntimeFolder::open(path, true);
  if (!folder) return folder.error();
  struct stat about {};
  Descriptor lock{::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (!lock.valid() || fstat(lock.get(), &about) != 0)
    return Error{fmt::format("{}: cannot be locked: {}", path, std::strerror(errno))};
  if (!lock.lock_within(kLockPatience))
    return Error{fmt::format("{}: another program has locked this folder for {} s", path, kLockPatience.count())};
  KeyMaker out(*std::move(folder), std::move(lock));
  if (about.st_mode & (S_IRWXG | S_IRWXO))
    return Error{fmt::format("{}: others may look into it (mode {:03o}); chmod 700 keeps it to yourself", path,
                             about.st_mode & 0777)};
  if (const Status s = refuse_strangers(out.folder_); !s) return s.error();
  if (!is_there(path, kAllowedFile)) return out;
  auto allowed = read_allow_list(path);
  if (!allowed) return allowed.error();
  out.allowed_ = *std::move(allowed);
  return out;
}

// Writes the secret first: a key on the allow-list without its secret could not be made again.
Status KeyMaker::make(const std::string& name, Role role) {
  const NamedKey key{name, role, make_key_pair()};
  if (const Status s = folder_.create(file_of(name), text_of(key)); !s) return s;
  if (role == Role::kServer) return folder_.write(kServerPublicFile, key.pair.open + "\n");
  allowed_.remove(name);  // an entry whose secret file was lost
  if (const Status s = allowed_.add({name, role, key.pair.open}); !s) return s;
  return folder_.write(kAllowedFile, allowed_.text());
}

Result<std::vector<std::string>> KeyMaker::make_missing() {
  std::vector<std::string> out;
  for (const Role role : kRoles) {
    const std::string name(name_of(role));
    if (is_there(folder_.path(), file_of(name))) {
      auto key = read_named_key(folder_.path(), name);
      if (!key) return key.error();
      if (role == Role::kServer && !is_there(folder_.path(), kServerPublicFile))
        if (const Status s = folder_.write(kServerPublicFile, key->pair.open + "\n"); !s) return s.error();
      if (role == Role::kServer || allowed_.named(name)) continue;
      // The power may have gone after the secret was written.
      if (const Status s = allowed_.add({name, role, key->pair.open}); !s) return s.error();
      if (const Status s = folder_.write(kAllowedFile, allowed_.text()); !s) return s.error();
      continue;
    }
    if (const Status s = make(name, role); !s) return s.error();
    out.push_back(name);
  }
  return out;
}

Status KeyMaker::add_person(const std::string& name, Role role) {
  if (const std::string why = complain_about_name(name); !why.empty())
    return Error{fmt::format("--person {}: a name {}", name.substr(0, 80), why)};
  if (role_named(name) || name == kMaster) return Error{fmt::format("--person {}: is the name of a role", name)};
  if (role != Role::kViewer && role != Role::kOperator)
    return Error{fmt::format("--role {}: persons are viewers or operators", name_of(role))};
  if (allowed_.named(name) || is_there(folder_.path(), file_of(name)))
    return Error{fmt::format("--person {}: there is a key of that name; --revoke it first", name)};
  return make(name, role);
}

Status KeyMaker::revoke(const std::string& name) {
  if (name == name_of(Role::kServer) || name == kMaster)
    return Error{fmt::format("--revoke {}: the server's key cannot be revoked; make a new folder of keys", name)};
  if (!allowed_.remove(name)) return Error{fmt::format("--revoke {}: no key has that name", name.substr(0, 80))};
  if (const Status s = folder_.write(kAllowedFile, allowed_.text()); !s) return s;
  folder_.remove(file_of(name));
  return ok_status();
}

Result<std::vector<std::string>> files_for(const AllowList& allowed, const std::string& name) {
  if (name == kMaster) return std::vector<std::string>{kServerFile, kServerPublicFile, kAllowedFile};
  const Allowed* key = allowed.named(name);
  if (!key) return Error{fmt::format("no key has the name {}", name.substr(0, 80))};
  const bool binds = key->role == Role::kData || key->role == Role::kPacker;
  std::vector<std::string> out;
  if (binds) out = {kServerFile, kAllowedFile};
  out.push_back(kServerPublicFile);
  out.push_back(file_of(name));
  return out;
}

Status bundle(const std::string& folder, const AllowList& allowed, const std::string& name, const std::string& out) {
  const auto files = files_for(allowed, name);
  if (!files) return Error{"--bundle: " + files.error().text};
  std::vector<std::string> texts;
  for (const std::string& file : *files) {
    auto text = read_key_file(folder + "/" + file, file.ends_with(kSecretEnd) ? Privacy::kSecret : Privacy::kOpen);
    if (!text) return text.error();
    texts.push_back(*std::move(text));
  }
  if (mkdir(out.c_str(), 0700) != 0) return Error{fmt::format("{}: cannot be made: {}", out, std::strerror(errno))};
  const auto made = RuntimeFolder::open(out, false);
  if (!made) return made.error();
  for (size_t i = 0; i < files->size(); ++i)
    if (const Status s = made->create((*files)[i], texts[i]); !s) return s;
  return ok_status();
}

}  // namespace telesplat::net
