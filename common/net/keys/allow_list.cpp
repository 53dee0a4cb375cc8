#include "common/net/keys/allow_list.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>

#include "common/net/keys/key_files.h"

namespace telesplat::net {
namespace {

constexpr size_t kMostName = 64;
constexpr std::string_view kHead =
    "# The public keys that are let in, one entry each. telesplat keys writes this file; master, data server and "
    "packer\n"
    "# read it again when it changes, and who is no longer in it does not come in again.\n";

std::string text_at(const toml::table& entry, std::string_view key) {
  const auto* value = entry.get_as<std::string>(key);
  return value ? value->get() : std::string();
}

Result<Allowed> read_entry(const toml::node& node, size_t number) {
  const auto wrong = [&](const std::string& why) { return Error{fmt::format("entry {}: {}", number, why)}; };
  const toml::table* entry = node.as_table();
  if (!entry) return wrong("is no table");
  Allowed out{.name = text_at(*entry, "name"), .key = text_at(*entry, "key")};
  if (const std::string why = complain_about_name(out.name); !why.empty()) return wrong("its name " + why);
  const std::string role = text_at(*entry, "role");
  const auto known = role_named(role);
  if (!known || known == Role::kServer)
    return wrong(fmt::format("role \"{}\" of {} is not data, packer, sampler, viewer or operator", role.substr(0, 40),
                             out.name));
  if (!is_key(out.key)) return wrong(fmt::format("the key of {} is none", out.name));
  out.role = *known;
  return out;
}

}  // namespace

std::string complain_about_name(std::string_view name) {
  if (name.empty() || name.size() > kMostName) return fmt::format("has not 1 to {} characters", kMostName);
  constexpr std::string_view kGood = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
  if (name.find_first_not_of(kGood) != name.npos || name.front() == '.' || name.front() == '-')
    return "may have letters, digits, '.', '_' and '-', and begins with a letter, a digit or '_'";
  return {};
}

Result<AllowList> AllowList::parse(std::string_view text) {
  if (text.size() > kMostBytes) return Error{fmt::format("has more than {} bytes", kMostBytes)};
  AllowList out;
  try {
    const toml::table table = toml::parse(text);
    const toml::node* list = table.get("allowed");
    if (!list) return out;  // lets no one in
    const toml::array* entries = list->as_array();
    if (!entries) return Error{"\"allowed\" is no list of tables"};
    for (size_t i = 0; i < entries->size(); ++i) {
      auto entry = read_entry(*entries->get(i), i + 1);
      if (!entry) return entry.error();
      if (const Status s = out.add(*std::move(entry)); !s) return s.error();
    }
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("line {}: {}", e.source().begin.line, e.description())};
  }
  return out;
}

std::string AllowList::text() const {
  std::string out(kHead);
  for (const Allowed& a : entries_)
    out += fmt::format("\n[[allowed]]\nname = \"{}\"\nrole = \"{}\"\nkey = \"{}\"\n", a.name, name_of(a.role), a.key);
  return out;
}

const Allowed* AllowList::named(std::string_view name) const {
  const auto found = std::ranges::find(entries_, name, &Allowed::name);
  return found == entries_.end() ? nullptr : &*found;
}

const Allowed* AllowList::of_key(std::string_view key) const {
  const auto found = std::ranges::find(entries_, key, &Allowed::key);
  return found == entries_.end() ? nullptr : &*found;
}

Status AllowList::add(Allowed entry) {
  if (entries_.size() >= kMost) return Error{fmt::format("{} keys are the most", kMost)};
  if (named(entry.name)) return Error{fmt::format("there is a key of {} already", entry.name)};
  if (of_key(entry.key)) return Error{fmt::format("the key of {} is another's, too", entry.name)};
  entries_.push_back(std::move(entry));
  return ok_status();
}

bool AllowList::remove(std::string_view name) {
  return std::erase_if(entries_, [&](const Allowed& a) { return a.name == name; }) > 0;
}

}  // namespace telesplat::net
