// Folders of keys: made once, never overwritten, refused if others could read or change them.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/net/keys/key_files.h"
#include "tests/support/keys/key_folder.h"

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;
using test::KeyFolder;

std::string text_of_file(const std::string& path) {
  std::ifstream in(path);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

unsigned mode_of(const std::string& path) {
  struct stat about {};
  EXPECT_EQ(stat(path.c_str(), &about), 0) << path;
  return about.st_mode & 0777;
}

void put(const std::string& path, const std::string& text, int mode) {
  std::ofstream(path) << text;
  chmod(path.c_str(), mode_t(mode));
}

TEST(KeyPairs, AreTextsThatBelongTogether) {
  const KeyPair pair = make_key_pair(), other = make_key_pair();
  EXPECT_TRUE(is_key(pair.open));
  EXPECT_TRUE(is_key(pair.secret));
  EXPECT_NE(pair.secret, other.secret);
  EXPECT_EQ(public_of(pair.secret), pair.open);
  EXPECT_NE(public_of(other.secret), pair.open);
  EXPECT_EQ(key_bytes(pair.open).size(), 32u);
  for (const std::string& text : {std::string(), pair.open.substr(1), pair.open + "0", std::string(40, '"'),
                                  std::string(40, '\0'), std::string(40, '\xff')})
    EXPECT_FALSE(is_key(text)) << text;
}

TEST(KeyFolders, AreForTheirOwnerAloneAndHaveAKeyForEachRole) {
  const KeyFolder keys;
  EXPECT_EQ(mode_of(keys.path()), 0700u);
  for (const Role role : kRoles) {
    const std::string name(name_of(role));
    EXPECT_EQ(mode_of(keys.path() + "/" + name + ".key"), 0600u);
    const auto key = read_named_key(keys.path(), name);
    ASSERT_TRUE(key.ok()) << key.error().text;
    EXPECT_EQ(key->role, role);
    const auto list = read_allow_list(keys.path());
    ASSERT_TRUE(list.ok());
    const Allowed* entry = list->named(name);
    ASSERT_EQ(entry != nullptr, role != Role::kServer) << name;
    if (!entry) continue;
    EXPECT_EQ(entry->key, key->pair.open);
    EXPECT_EQ(entry->role, role);
    EXPECT_EQ(list->of_key(key->pair.open), entry);
  }
  EXPECT_EQ(text_of_file(keys.path() + "/server.pub"), read_named_key(keys.path(), "server")->pair.open + "\n");
  for (const auto& file : fs::directory_iterator(keys.path()))
    EXPECT_NE(file.path().filename().string().front(), '.') << "left over: " << file.path();
}

TEST(KeyFolders, NothingIsOverwritten) {
  const KeyFolder keys;
  const std::string sampler = text_of_file(keys.path() + "/sampler.key");
  EXPECT_EQ(keys.maker().make_missing()->size(), 0u);
  EXPECT_EQ(text_of_file(keys.path() + "/sampler.key"), sampler);
  EXPECT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok());
  EXPECT_EQ(keys.maker().add_person("anna", Role::kOperator).error().text,
            "--person anna: there is a key of that name; --revoke it first");
  // A file that came from elsewhere.
  put(keys.path() + "/ben.key", "mine", 0600);
  EXPECT_FALSE(keys.maker().add_person("ben", Role::kViewer).ok());
  EXPECT_EQ(text_of_file(keys.path() + "/ben.key"), "mine");
}

TEST(KeyFolders, WhatIsMissingIsMadeAnew) {
  const KeyFolder keys;
  const std::string before = read_named_key(keys.path(), "sampler")->pair.open;
  ASSERT_TRUE(keys.maker().revoke("sampler").ok());
  EXPECT_FALSE(fs::exists(keys.path() + "/sampler.key"));
  EXPECT_EQ(read_allow_list(keys.path())->named("sampler"), nullptr);
  EXPECT_EQ(*keys.maker().make_missing(), std::vector<std::string>{"sampler"});
  EXPECT_NE(read_named_key(keys.path(), "sampler")->pair.open, before);
  EXPECT_EQ(read_allow_list(keys.path())->of_key(before), nullptr);
  // The power failed between the key and the list.
  ASSERT_TRUE(fs::remove(keys.path() + "/allowed.toml"));
  ASSERT_TRUE(fs::remove(keys.path() + "/server.pub"));
  EXPECT_EQ(keys.maker().make_missing()->size(), 0u);
  EXPECT_EQ(read_allow_list(keys.path())->entries().size(), 5u);
  EXPECT_TRUE(fs::exists(keys.path() + "/server.pub"));
}

TEST(KeyFolders, NamesThatNobodyCanHaveAreRefused) {
  const KeyFolder keys;
  for (const std::string& name : {std::string("../x"), std::string("a b"), std::string(""), std::string(65, 'a'),
                                  std::string(".x"), std::string("-x"), std::string("caf\xc3\xa9"), std::string("a\n")})
    EXPECT_FALSE(keys.maker().add_person(name, Role::kViewer).ok()) << name;
  for (const char* name : {"server", "sampler", "operator", "master"})
    EXPECT_FALSE(keys.maker().add_person(name, Role::kViewer).ok()) << name;
  EXPECT_FALSE(keys.maker().add_person("anna", Role::kPacker).ok());
  EXPECT_FALSE(keys.maker().revoke("nobody").ok());
  EXPECT_EQ(keys.maker().revoke("server").error().text,
            "--revoke server: the server's key cannot be revoked; make a new folder of keys");
}

TEST(KeyFolders, OfStrangersAndOpenOnesAreRefused) {
  const KeyFolder keys;
  const std::string path = keys.path();
  chmod(path.c_str(), 0755);
  EXPECT_EQ(KeyMaker::open(path).error().text,
            path + ": others may look into it (mode 755); chmod 700 keeps it to yourself");
  EXPECT_TRUE(read_keys(path, {Role::kViewer}, false).ok()) << "to be used it may be seen, as ~/.ssh may";
  chmod(path.c_str(), 0777);
  EXPECT_NE(read_keys(path, {Role::kViewer}, false).error().text.find("others may write into"), std::string::npos);
  chmod(path.c_str(), 0700);
  const std::string documents = path + "-documents";
  fs::create_directory(documents);
  chmod(documents.c_str(), 0700);
  put(documents + "/thesis.tex", "x", 0600);
  EXPECT_EQ(KeyMaker::open(documents).error().text, documents + ": holds thesis.tex, and no keys; name a new folder");
  fs::remove_all(documents);
  EXPECT_FALSE(KeyMaker::open(path + "/no/such").ok());
}

TEST(KeyFiles, ThatOthersMayReadAreRefusedAsSshDoes) {
  const KeyFolder keys;
  const std::string file = keys.path() + "/viewer.key";
  for (const int mode : {0640, 0604, 0660, 0644}) {
    chmod(file.c_str(), mode_t(mode));
    const auto read = read_keys(keys.path(), {Role::kViewer}, false);
    ASSERT_FALSE(read.ok()) << mode;
    EXPECT_NE(read.error().text.find(file + ": others may read this secret key (mode 6"), std::string::npos)
        << read.error().text;
  }
  chmod(file.c_str(), 0400);
  EXPECT_TRUE(read_keys(keys.path(), {Role::kViewer}, false).ok());
  const std::string list = keys.path() + "/allowed.toml";
  chmod(list.c_str(), 0644);
  EXPECT_TRUE(read_keys(keys.path(), {Role::kData}, true).ok()) << "the list is no secret";
  chmod(list.c_str(), 0664);
  EXPECT_FALSE(read_keys(keys.path(), {Role::kData}, true).ok());
}

TEST(KeyFiles, ThatAreNoneAreRefusedInALine) {
  const KeyFolder keys;
  const std::string file = keys.path() + "/viewer.key", whole = text_of_file(file);
  const KeyPair other = make_key_pair();
  const auto with = [&](const std::string& key, const std::string& value) {
    std::string out = whole;
    const size_t at = out.find(key + " = \"") + key.size() + 4;
    return out.replace(at, out.find('"', at) - at, value);
  };
  const std::string damaged[] = {"",
                                 "not toml [",
                                 with("role", "king"),
                                 with("name", "../x"),
                                 with("name", "anna"),
                                 with("public", other.open),
                                 with("secret", "short"),
                                 std::string(2 << 20, '#'),
                                 whole.substr(0, whole.size() / 2)};
  for (const std::string& text : damaged) {
    put(file, text, 0600);
    const auto read = read_keys(keys.path(), {Role::kViewer}, false);
    ASSERT_FALSE(read.ok()) << text.substr(0, 200);
    EXPECT_TRUE(read.error().text.starts_with(file + ": ")) << read.error().text;
    EXPECT_EQ(read.error().text.find('\n'), std::string::npos);
    EXPECT_EQ(read.error().text.find("secret = "), std::string::npos) << "it tells the secret";
  }
  fs::remove(file);
  fs::create_directory(file);
  EXPECT_FALSE(read_keys(keys.path(), {Role::kViewer}, false).ok());
}

TEST(KeyFiles, EachProcessFindsItsOwn) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok());
  EXPECT_EQ(read_keys(keys.path(), {Role::kViewer}, false)->own->name, "viewer") << "the role's before a person's";
  EXPECT_EQ(read_keys(keys.path(), {Role::kOperator, Role::kViewer}, false)->own->name, "operator");
  const std::string laptop = keys.path() + "-laptop";
  ASSERT_TRUE(bundle(keys.path(), keys.maker().allowed(), "anna", laptop).ok());
  EXPECT_EQ(key_names(laptop), std::vector<std::string>{"anna"});
  EXPECT_EQ(mode_of(laptop), 0700u);
  EXPECT_EQ(mode_of(laptop + "/anna.key"), 0600u);
  EXPECT_FALSE(fs::exists(laptop + "/server.key"));
  const auto hers = read_keys(laptop, {Role::kOperator, Role::kViewer}, false);
  ASSERT_TRUE(hers.ok());
  EXPECT_EQ(hers->own->name, "anna");
  EXPECT_EQ(hers->server_secret, "");
  const auto missing = read_keys(laptop, {Role::kSampler}, false);
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().text,
            laptop +
                ": there is no key of a sampler (anna is a viewer's); who made this bundle can make another: "
                "telesplat keys FOLDER BUNDLE --bundle NAME");
  fs::remove(keys.path() + "/sampler.key");
  const auto lost = read_keys(keys.path(), {Role::kSampler}, false);
  ASSERT_FALSE(lost.ok());
  EXPECT_TRUE(lost.error().text.ends_with("telesplat keys " + keys.path() + " makes keys")) << lost.error().text;
  EXPECT_TRUE(keys.maker().make_missing().ok());
  EXPECT_FALSE(read_keys(laptop, {}, true).ok()) << "it cannot bind";
  EXPECT_FALSE(bundle(keys.path(), keys.maker().allowed(), "anna", laptop).ok()) << "it is there already";
  EXPECT_FALSE(bundle(keys.path(), keys.maker().allowed(), "nobody", laptop + "2").ok());
  fs::remove_all(laptop);
}

TEST(KeyFiles, AMachineGetsWhatItsRoleNeedsAndNoMore) {
  const KeyFolder keys;
  const AllowList allowed = keys.maker().allowed();
  using Files = std::vector<std::string>;
  EXPECT_EQ(*files_for(allowed, "master"), (Files{"server.key", "server.pub", "allowed.toml"}));
  EXPECT_EQ(*files_for(allowed, "data"), (Files{"server.key", "allowed.toml", "server.pub", "data.key"}));
  EXPECT_EQ(*files_for(allowed, "packer"), (Files{"server.key", "allowed.toml", "server.pub", "packer.key"}));
  EXPECT_EQ(*files_for(allowed, "sampler"), (Files{"server.pub", "sampler.key"}));
  EXPECT_EQ(*files_for(allowed, "operator"), (Files{"server.pub", "operator.key"}));
  EXPECT_FALSE(files_for(allowed, "anna").ok());
}

TEST(AllowLists, ReadWhatTheyWrite) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna.b-c_1", Role::kOperator).ok());
  const AllowList list = keys.maker().allowed();
  const auto again = AllowList::parse(list.text());
  ASSERT_TRUE(again.ok()) << again.error().text;
  EXPECT_EQ(again->entries(), list.entries());
  EXPECT_EQ(again->entries().size(), 6u);
  EXPECT_TRUE(AllowList::parse("")->entries().empty());
}

TEST(AllowLists, ThatAreWrongAreRefusedWhole) {
  const std::string key = make_key_pair().open;
  const auto entry = [](const std::string& name, const std::string& role, const std::string& key) {
    return "[[allowed]]\nname = \"" + name + "\"\nrole = \"" + role + "\"\nkey = \"" + key + "\"\n";
  };
  ASSERT_TRUE(AllowList::parse(entry("anna", "viewer", key)).ok());
  for (const std::string& text :
       {entry("anna", "viewer", key) + entry("anna", "viewer", make_key_pair().open),
        entry("anna", "viewer", key) + entry("ben", "operator", key), entry("anna", "king", key),
        entry("anna", "server", key), entry("anna", "viewer", "short"), entry("", "viewer", key),
        entry("a/b", "viewer", key), std::string("allowed = 3"), std::string("allowed = [1, 2]"),
        std::string("[[allowed]]\nname = 3\n"), std::string("[[allowed"), std::string((1 << 20) + 1, '#')})
    EXPECT_FALSE(AllowList::parse(text).ok()) << text.substr(0, 300);
}

}  // namespace
}  // namespace telesplat::net
