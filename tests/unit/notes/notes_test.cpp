// Books of notes: notes come back; hostile and broken files are refused and left as they are.
#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>

#include "client/notes/shelf.h"
#include "common/core/descriptor.h"
#include "tests/support/patience.h"

namespace telesplat::notes {
namespace {

namespace fs = std::filesystem;

class Notes : public testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/telesplat-notes-XXXXXX";
    folder = mkdtemp(name);
    fs::create_directories(folder + "/data");
    std::ofstream(folder + "/data/head.nrrd") << "data";
    shelf = shelf_of(folder + "/data/head.nrrd", "head.nrrd", folder + "/cache");
  }
  void TearDown() override {
    fs::permissions(folder + "/data", fs::perms::owner_all);
    fs::remove_all(folder);
  }
  static std::string content(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void write(const std::string& path, const std::string& text) {
    fs::create_directories(fs::path(path).parent_path());
    std::ofstream(path, std::ios::binary) << text;
  }
  static Status add_note(const Shelf& shelf, const std::string& text, std::string* path = nullptr) {
    return change_book(
        shelf,
        [&](Book& book) -> Status {
          const auto number = book.add({.text = text});
          if (!number) return number.error();
          return ok_status();
        },
        path);
  }
  std::string folder;
  Shelf shelf;
};

Book full_book() {
  Book book;
  EXPECT_TRUE(book.keep({"from above", {{0.1, 2.5, -3}, {0.6, 0, 0.8, 0}}, "2026-03-01T12:00:00Z"}));
  EXPECT_TRUE(book.keep({"n\xc3\xa4her", {{1.0 / 3, 0, 1e-9}, {1, 0, 0, 0}}, ""}));
  EXPECT_TRUE(book.add({.text = "a crack\nin the wall", .place = glm::dvec3(512000.25, 1e-3, -7), .value = "21.5 K"}));
  EXPECT_TRUE(book.add({.text = "no place"}));
  return book;
}

TEST_F(Notes, ABookComesBackAsItWas) {
  const Book book = full_book();
  const auto read = book_from_json(to_json(book));
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(*read, book);
}

TEST_F(Notes, LieBesideTheData) {
  std::string path;
  ASSERT_TRUE(add_note(shelf, "one", &path));
  EXPECT_EQ(path, folder + "/data/head.nrrd.notes.json");
  ASSERT_TRUE(add_note(shelf, "two"));
  const auto book = read_book(shelf, &path);
  ASSERT_TRUE(book);
  EXPECT_EQ(path, folder + "/data/head.nrrd.notes.json");
  ASSERT_EQ(book->notes.size(), 2u);
  EXPECT_EQ(book->notes[1].text, "two");
  EXPECT_EQ(book->notes[1].number, 2u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder + "/data"), {}), 2) << "no temporary file stays";
}

// A book in a folder that cannot be written is read, and new notes go into the cache.
TEST_F(Notes, LieInTheCacheWhereNobodyMayWrite) {
  if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  ASSERT_TRUE(add_note(shelf, "one"));
  fs::permissions(folder + "/data", fs::perms::owner_read | fs::perms::owner_exec);
  std::string path;
  ASSERT_TRUE(add_note(shelf, "two", &path));
  EXPECT_EQ(path, shelf.in_cache);
  const auto book = read_book(shelf);
  ASSERT_TRUE(book);
  EXPECT_EQ(book->notes.size(), 2u);
}

TEST_F(Notes, LieInTheCacheWhereTheFolderIsNoFolderOfOurs) {
  const Shelf elsewhere = shelf_of("/proc/version/head.nrrd", "head.nrrd", folder + "/cache");
  std::string path;
  ASSERT_TRUE(add_note(elsewhere, "one", &path));
  EXPECT_EQ(path, elsewhere.in_cache);
}

// The book's name would be longer than a file system takes, though the data's is not.
TEST_F(Notes, LieInTheCacheWhereTheirNameIsTooLong) {
  const std::string data = folder + "/data/" + std::string(250, 'a');
  write(data, "data");
  const Shelf longest = shelf_of(data, "", folder + "/cache");
  std::string path;
  for (const char* text : {"one", "two"}) {
    const Status added = add_note(longest, text, &path);
    ASSERT_TRUE(added) << added.error().text;
    EXPECT_EQ(path, longest.in_cache);
  }
  EXPECT_EQ(read_book(longest)->notes.size(), 2u);
  // A name just short enough: even a temporary suffix would not fit.
  const std::string fits = folder + "/data/" + std::string(244, 'b');
  ASSERT_TRUE(add_note(shelf_of(fits, "", folder + "/cache"), "one", &path));
  EXPECT_EQ(path, fits + ".notes.json");
}

TEST_F(Notes, WhatOtherProgramsKeepStays) {
  write(shelf.beside, R"({"by": {"who": ["me", 1.5]}, "telesplat_notes": 1,
    "bookmarks": [{"name": "a", "position": [0, 0, 1], "orientation": [1, 0, 0, 0], "colour": "red"}],
    "notes": [{"number": 3, "text": "crack", "status": {"open": true}}]})");
  const Status changed = change_book(shelf, [](Book& book) -> Status {
    if (const Status s = book.keep({"a", {{1, 0, 0}, {1, 0, 0, 0}}, ""}); !s) return s;
    return book.keep({"b", {{1, 0, 0}, {1, 0, 0, 0}}, ""});
  });
  ASSERT_TRUE(changed) << changed.error().text;
  const std::string text = content(shelf.beside);
  for (const char* kept : {"\"who\"", "1.5", "\"colour\": \"red\"", "\"open\": true"})
    EXPECT_NE(text.find(kept), std::string::npos) << kept << " in " << text;
  const auto book = read_book(shelf);
  ASSERT_TRUE(book) << book.error().text;
  EXPECT_EQ(book->find("a")->pose.position_room.x, 1);
  EXPECT_EQ(book->find("b")->others, "");
  EXPECT_EQ(*book_from_json(to_json(*book)), *book);
  // Deeply nested JSON would end the program on reading or writing.
  const std::string deep(200000, '[');
  EXPECT_FALSE(book_from_json("{\"telesplat_notes\":1,\"x\":" + deep + std::string(deep.size(), ']') + "}"));
}

// Reading takes linear, not quadratic, time, for any content of other programs.
TEST_F(Notes, LongListsOfOthersAreReadAtOnce) {
  std::string list = "{}";
  for (int i = 0; i < 200'000; ++i) list += ",{\"a\":1}";
  const std::clock_t begin = std::clock();
  const auto book = book_from_json("{\"telesplat_notes\":1,\"x\":[" + list + "]}");
  ASSERT_TRUE(book) << book.error().text;
  EXPECT_GT(to_json(*book).size(), list.size());
  EXPECT_LT(double(std::clock() - begin) / CLOCKS_PER_SEC, test::patient(4));
  std::string keys = "\"a0\":0";
  for (size_t i = 1; i < kMostKeys; ++i) keys += fmt::format(",\"a{}\":{}", i, i);
  const auto with = [](const std::string& keys) { return "{\"telesplat_notes\":1,\"x\":{" + keys + "}}"; };
  EXPECT_TRUE(book_from_json(with(keys)));
  const auto more = book_from_json(with(keys + ",\"\\\":\":1"));
  ASSERT_FALSE(more);
  EXPECT_NE(more.error().text.find("1000 keys"), std::string::npos) << more.error().text;
  const std::string deep(size_t(kMaxDepth) - 1, '['), up(deep.size(), ']');
  EXPECT_TRUE(book_from_json("{\"telesplat_notes\":1,\"x\":" + deep + up + "}"));
  EXPECT_FALSE(book_from_json("{\"telesplat_notes\":1,\"x\":" + deep + "[]" + up + "}"));
  EXPECT_TRUE(book_from_json(with("\"x\":\"" + std::string(100, '[') + ":\"")));
}

TEST_F(Notes, WhoMayReadThemStays) {
  const auto mode = [&] { return fs::status(shelf.beside).permissions(); };
  ASSERT_TRUE(add_note(shelf, "one"));
  const mode_t mask = umask(0);
  umask(mask);
  EXPECT_EQ(mode(), fs::perms(0666 & ~mask)) << "as any new file";
  fs::permissions(shelf.beside, fs::perms(0600));
  ASSERT_TRUE(add_note(shelf, "two"));
  EXPECT_EQ(mode(), fs::perms(0600));
}

constexpr uid_t kAlice = 61001, kBob = 61002;
constexpr gid_t kLab = 61003;

struct stat facts_of(const std::string& path) {
  struct stat out {};
  EXPECT_EQ(stat(path.c_str(), &out), 0) << path;
  return out;
}

TEST_F(Notes, WhoseTheyAreStays) {
  if (geteuid() != 0) GTEST_SKIP() << "only root writes for others";
  ASSERT_TRUE(add_note(shelf, "one"));
  ASSERT_EQ(chown(shelf.beside.c_str(), kAlice, kLab), 0);
  fs::permissions(shelf.beside, fs::perms(0600));
  const Status added = add_note(shelf, "two");
  ASSERT_TRUE(added) << added.error().text;
  const struct stat now = facts_of(shelf.beside);
  EXPECT_EQ(now.st_uid, kAlice);
  EXPECT_EQ(now.st_gid, kLab);
  EXPECT_EQ(now.st_mode & 0777, 0600u);
}

// Bob writes into a folder that Alice shares with him, and Alice loses no access.
TEST_F(Notes, WhoWritesForAGroupTakesThemFromNobody) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  fs::permissions(folder, fs::perms(0755));
  fs::create_directories(folder + "/cache");
  ASSERT_EQ(chown((folder + "/cache").c_str(), kBob, kBob), 0);
  // Returns Bob's exit code, with these groups: 0: beside the data, 1: in the cache, 2: nowhere.
  const auto add_as_bob = [&](const std::vector<gid_t>& groups) {
    const pid_t child = fork();
    if (child == 0) {
      std::string path;
      const bool bob = setgroups(groups.size(), groups.data()) == 0 && setgid(kBob) == 0 && setuid(kBob) == 0;
      _exit(!bob || !add_note(shelf, "two", &path) ? 2 : path == shelf.in_cache);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  struct Case {
    const char* name;
    mode_t folder, file;
    std::vector<gid_t> groups;
    int expected;
  };
  for (const Case& c : {Case{"a group's folder", 0777, 0660, {kLab}, 0}, Case{"everybody's", 0777, 0666, {}, 0},
                        Case{"the group could read it no more", 0777, 0676, {}, 1},
                        Case{"a folder like /tmp", 01777, 0666, {kLab}, 1}}) {
    fs::remove_all(folder + "/cache/notes");
    write(shelf.beside, to_json(full_book()));
    ASSERT_EQ(chown(shelf.beside.c_str(), kAlice, kLab), 0);
    ASSERT_EQ(chmod(shelf.beside.c_str(), c.file), 0);
    ASSERT_EQ(chmod((folder + "/data").c_str(), c.folder), 0);
    EXPECT_EQ(add_as_bob(c.groups), c.expected) << c.name;
    const struct stat now = facts_of(shelf.beside);
    EXPECT_EQ(now.st_mode & 0777, c.file) << c.name;
    if (!c.groups.empty()) EXPECT_EQ(now.st_gid, kLab) << c.name;
    if (c.expected == 1) EXPECT_EQ(now.st_uid, kAlice) << c.name;
    const auto book = book_from_json(content(shelf.beside));
    ASSERT_TRUE(book) << c.name;
    EXPECT_EQ(book->notes.size(), full_book().notes.size() + (c.expected == 0 ? 1 : 0)) << c.name;
  }
}

TEST_F(Notes, ALinkStaysALink) {
  const std::string kept = folder + "/elsewhere/mine.json";
  write(kept, to_json(full_book()));
  fs::create_symlink("../elsewhere/mine.json", shelf.beside);
  std::string path;
  ASSERT_TRUE(add_note(shelf, "one", &path));
  EXPECT_EQ(path, shelf.beside);
  EXPECT_TRUE(fs::is_symlink(shelf.beside));
  EXPECT_EQ(book_from_json(content(kept))->notes.size(), full_book().notes.size() + 1);
  fs::remove(kept);
  ASSERT_TRUE(add_note(shelf, "one", &path)) << "the link leads nowhere";
  EXPECT_EQ(path, shelf.in_cache);
}

TEST_F(Notes, OfScenesWithoutAFileLieInTheCache) {
  const Shelf julia = shelf_of("", "julia lantern", folder + "/cache");
  EXPECT_EQ(julia.beside, "");
  std::string path;
  ASSERT_TRUE(add_note(julia, "one", &path));
  EXPECT_TRUE(path.starts_with(folder + "/cache/notes/")) << path;
  EXPECT_NE(julia.in_cache, shelf_of("", "julia other", folder + "/cache").in_cache);
  EXPECT_FALSE(add_note(shelf_of("", "julia", ""), "one"));
}

// Any fault of a file is reported, and the file stays as it is.
TEST_F(Notes, ABadFileIsRefusedAndStays) {
  const std::string good = to_json(full_book());
  std::vector<std::string> bad{"",
                               "{",
                               "[]",
                               "null",
                               "{}",
                               "{\"telesplat_notes\":2}",
                               "{\"telesplat_notes\":\"1\"}",
                               std::string(1 << 20, '['),
                               "\xff\xfe",
                               std::string(5 << 20, ' ')};
  for (const char* rest :
       {"\"bookmarks\":{}", "\"bookmarks\":[1]", "\"bookmarks\":[{}]", "\"notes\":[{\"number\":0,\"text\":\"a\"}]",
        "\"notes\":[{\"number\":-1,\"text\":\"a\"}]", "\"notes\":[{\"number\":1,\"text\":\"\"}]",
        "\"notes\":[{\"number\":1,\"text\":\"a\"},{\"number\":1,\"text\":\"b\"}]",
        "\"notes\":[{\"number\":1,\"text\":\"a\",\"place\":[1,2]}]",
        "\"notes\":[{\"number\":1,\"text\":\"a\",\"place\":[1,2,1e999]}]",
        "\"bookmarks\":[{\"name\":\"\",\"position\":[0,0,0],\"orientation\":[1,0,0,0]}]",
        "\"bookmarks\":[{\"name\":\"a\\nb\",\"position\":[0,0,0],\"orientation\":[1,0,0,0]}]",
        "\"bookmarks\":[{\"name\":\"a\",\"position\":[0,0,1e9],\"orientation\":[1,0,0,0]}]",
        "\"bookmarks\":[{\"name\":\"a\",\"position\":[0,0,0],\"orientation\":[0,0,0,0]}]"})
    bad.push_back(std::string("{\"telesplat_notes\":1,") + rest + "}");
  for (const std::string& text : bad) {
    write(shelf.beside, text);
    const auto read = read_book(shelf);
    ASSERT_FALSE(read) << text.substr(0, 80);
    EXPECT_TRUE(read.error().text.starts_with(shelf.beside)) << read.error().text;
    EXPECT_FALSE(add_note(shelf, "one"));
    EXPECT_EQ(content(shelf.beside), text);
  }
}

// Cut off anywhere, or with any byte changed: refused or read, and a refusal never changes the file.
TEST_F(Notes, DamagedFilesNeverHurt) {
  const std::string good = to_json(full_book());
  for (size_t n = 0; n + 2 < good.size(); ++n) EXPECT_FALSE(book_from_json(good.substr(0, n))) << n;
  std::mt19937 random(17);
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (unsigned n = 1 + random() % 4; n > 0; --n) text[random() % text.size()] = char(random() & 255);
    const auto read = book_from_json(text);
    refused += !read;
    if (read) EXPECT_EQ(*book_from_json(to_json(*read)), *read);
  }
  EXPECT_GT(refused, 500);
}

TEST_F(Notes, WhoWritesAtTheSameTimeLosesNothing) {
  std::vector<std::thread> writers;
  for (int w = 0; w < 4; ++w)
    writers.emplace_back([&, w] {
      for (int i = 0; i < 20; ++i) EXPECT_TRUE(add_note(shelf, "note " + std::to_string(w)));
    });
  for (auto& t : writers) t.join();
  const auto book = read_book(shelf);
  ASSERT_TRUE(book) << book.error().text;
  EXPECT_EQ(book->notes.size(), 80u);
}

TEST_F(Notes, ALockedFolderIsNamedAfterSeconds) {
  const Descriptor lock{::open(fs::path(shelf.beside).parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  ASSERT_TRUE(lock.lock(LOCK_EX));
  const Status kept = add_note(shelf, "a note");
  ASSERT_FALSE(kept);
  EXPECT_NE(kept.error().text.find("another program has locked this folder for 5 s"), std::string::npos)
      << kept.error().text;
  EXPECT_FALSE(fs::exists(shelf.beside));
}

TEST_F(Notes, AChangeThatIsRefusedWritesNothing) {
  EXPECT_FALSE(change_book(shelf, [](Book& book) { return book.remove_note(3); }));
  EXPECT_FALSE(fs::exists(shelf.beside));
  Book book;
  EXPECT_FALSE(book.keep({"", {}, ""}));
  EXPECT_FALSE(book.keep({std::string(81, 'a'), {}, ""}));
  EXPECT_FALSE(book.add({.text = std::string(4001, 'a')}));
  EXPECT_TRUE(book.keep({"a", {}, ""}));
  EXPECT_TRUE(book.keep({"a", {{1, 0, 0}, {1, 0, 0, 0}}, ""}));
  EXPECT_EQ(book.bookmarks.size(), 1u);
  EXPECT_EQ(book.find("a")->pose.position_room.x, 1);
  EXPECT_FALSE(book.remove_bookmark("b"));
}

}  // namespace
}  // namespace telesplat::notes
