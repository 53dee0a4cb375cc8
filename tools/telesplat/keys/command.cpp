// `telesplat keys DIR`: makes, lists, revokes and hands out keys.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "common/net/keys/key_files.h"
#include "common/net/keys/key_maker.h"
#include "common/options/complain.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/command.h"

namespace telesplat::launcher {
namespace {

struct KeysOptions {
  std::string folder, out;
  std::string person, role = "viewer", revoked, bundled;
  bool list = false;
};

options::Table table(KeysOptions& o) {
  return {
      {.flag = "folder",
       .value = &o.folder,
       .help = "folder of keys; what is missing of the server's and the roles' keys is made, nothing is overwritten",
       .required = true},
      {.flag = "out", .value = &o.out, .help = "with --bundle: the folder to make"},
      {.flag = "--person", .value = &o.person, .help = "make a key for a person of this name"},
      {.flag = "--role",
       .value = &o.role,
       .help = "what the person may do: viewers look; operators also change the session for everyone, and end it",
       .limits = options::Names{"viewer", "operator"}},
      {.flag = "--revoke",
       .value = &o.revoked,
       .help = "this key is not let in any more: it leaves the allow-list, and its file is removed"},
      {.flag = "--bundle",
       .value = &o.bundled,
       .help = "copy what one machine needs into the folder OUT: of master, data, packer, sampler, viewer, "
               "operator, or a person"},
      {.flag = "--list", .value = &o.list, .help = "make nothing, only tell what is there"}};
}

void print(const std::string& text) { std::fputs((text + "\n").c_str(), stdout); }

// Prints the keys that may connect, and the files that each machine needs.
void tell(const std::string& folder, const net::AllowList& allowed) {
  tools::TextTable keys({{"key", false}, {"role", false}, {"public key", false}});
  tools::TextTable files({{"machine of", false}, {"files", false}});
  const auto add_files = [&](const std::string& name) {
    if (const auto needed = net::files_for(allowed, name))
      files.add({name, fmt::format("{}", fmt::join(*needed, " "))});
  };
  add_files("master");
  for (const auto& a : allowed.entries()) {
    keys.add({a.name, std::string(net::name_of(a.role)), a.key});
    add_files(a.name);
  }
  print(fmt::format("keys that are let in, {}/{}:", folder, net::kAllowedFile));
  std::fputs(keys.text().c_str(), stdout);
  print("\nfiles that a machine needs (telesplat keys " + folder + " --bundle NAME OUT makes such a folder):");
  std::fputs(files.text().c_str(), stdout);
}

// Refuses two actions at a time.
Status check(const KeysOptions& o, const options::Given& given) {
  const auto is_given = [&](const char* flag) { return std::ranges::find(given, flag) != given.end(); };
  std::vector<std::string> asked;
  for (const char* flag : {"--person", "--revoke", "--bundle", "--list"})
    if (is_given(flag)) asked.emplace_back(flag);
  if (asked.size() > 1) return Error{fmt::format("{}: one at a time", fmt::join(asked, ", "))};
  if (is_given("--role") && !is_given("--person")) return Error{"--role is given, but no --person"};
  if (o.bundled.empty() != o.out.empty())
    return Error{o.out.empty() ? "--bundle: into which folder? (telesplat keys DIR --bundle NAME OUT)"
                               : o.out.substr(0, 200) + ": without --bundle nothing is copied there"};
  const bool changes = !is_given("--list") && !is_given("--revoke") && !is_given("--bundle");
  std::error_code error;
  if (!changes && !std::filesystem::exists(o.folder + "/" + net::kServerFile, error))
    return Error{fmt::format("{}: holds no keys; telesplat keys {} makes some", o.folder, o.folder)};
  return ok_status();
}

Status hand_out(const KeysOptions& o, const net::AllowList& allowed) {
  if (const Status s = net::bundle(o.folder, allowed, o.bundled, o.out); !s) return s;
  const auto files = net::files_for(allowed, o.bundled);
  print(fmt::format("{}: {} for a machine of {}; copy the folder there over a safe way, and remove it here", o.out,
                    fmt::join(*files, " "), o.bundled));
  return ok_status();
}

Status make(const KeysOptions& o, net::KeyMaker& maker) {
  const auto made = maker.make_missing();
  if (!made) return made.error();
  if (!made->empty()) print(fmt::format("made keys of {}\n", fmt::join(*made, ", ")));
  if (o.person.empty()) return ok_status();
  if (const Status s = maker.add_person(o.person, *net::role_named(o.role)); !s) return s;
  print(fmt::format("made a key of {}, {}: {}/{}{}\n", o.person, net::described(*net::role_named(o.role)), o.folder,
                    o.person, net::kSecretEnd));
  return ok_status();
}

Status revoke(const KeysOptions& o, net::KeyMaker& maker) {
  if (const Status s = maker.revoke(o.revoked); !s) return s;
  print(fmt::format("{} is not let in any more; masters, data servers and packers on other machines need the new {}",
                    o.revoked, net::kAllowedFile));
  if (net::role_named(o.revoked)) print(fmt::format("telesplat keys {} makes a new key of {}", o.folder, o.revoked));
  return ok_status();
}

int keys(KeysOptions o, const options::Given& given) {
  if (const Status s = check(o, given); !s) return complain(s.error());
  auto maker = net::KeyMaker::open(o.folder);
  if (!maker) return complain(maker.error());
  Status done = ok_status();
  if (!o.bundled.empty())
    done = hand_out(o, maker->allowed());
  else if (!o.revoked.empty())
    done = revoke(o, *maker);
  else if (!o.list)
    done = make(o, *maker);
  if (!done) return complain(done.error());
  if (o.bundled.empty() && o.revoked.empty()) tell(o.folder, maker->allowed());
  return 0;
}

}  // namespace

Command keys_command() {
  return make_command("keys", "make, list, revoke and hand out the keys by which processes and people are known", table,
                      keys);
}

}  // namespace telesplat::launcher
