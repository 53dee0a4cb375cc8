// Sessions with keys, in processes of their own: peers with a right to it come in; others do not, and change nothing.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <filesystem>

#include "common/net/control.h"
#include "tests/support/keys/key_folder.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::test {
namespace {

using net::Role;

Result<std::string> ask(const std::string& master, const net::Access& access, const std::string& command) {
  return net::ask_master(master, command, patient(5), {}, access);
}

TEST(KeysOfSessions, AViewersKeyCanLookAndNothingElse) {
  const KeyFolder keys;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok());
  PipelineRun run({"--duration", "0", "--keys", keys.path()});
  const std::string master = run.master();
  const net::Access anna = keys.named("anna"), operators = keys.of(Role::kOperator);
  ASSERT_TRUE(wait_until([&] {
    const auto status = ask(master, anna, "status");
    return status && value(nlohmann::json::parse(*status), "viewer-1", "points") > 0;
  })) << run.program().err();
  for (const char* command : {"stop", "set", "animate", "tf", "colour", "clip", "play", "epoch", "coupling"}) {
    const auto answer = ask(master, anna, command);
    ASSERT_FALSE(answer.ok()) << command;
    EXPECT_EQ(answer.error().text, std::string("refused: ") + command +
                                       " changes the session for everyone, which needs an operator's key, and the key "
                                       "anna is a viewer's");
  }
  // Nor does it lease tiles, in its own name or another's, or count as anything but a viewer.
  net::Context context(anna);
  net::Socket peer(context, net::Kind::kDealer, "anna", net::kControlSocket);
  ASSERT_TRUE(peer.connect(master).ok());
  wire::Hello hello;
  hello.role = "sampler";
  hello.name = "sampler-1";
  hello.instance = {4711};
  peer.send(hello);
  peer.send(wire::LeaseRequest{{4711}});
  peer.send(wire::Shutdown{"now"});
  peer.send(wire::Control{"status", {}});  // its answer comes behind theirs
  std::vector<std::string> answers;
  ASSERT_TRUE(wait_until([&] {
    while (const auto answer = peer.receive()) answers.push_back(answer->type);
    return !answers.empty() && answers.back() == wire::ControlReply::kName;
  }));
  EXPECT_EQ(answers,
            (std::vector<std::string>{std::string(wire::Shutdown::kName), std::string(wire::ControlReply::kName)}))
      << "why it is refused; neither welcome nor lease";
  const auto now = nlohmann::json::parse(*ask(master, anna, "status"));
  EXPECT_GE(now["messages_rejected"], 12);
  EXPECT_FALSE(process(now, "sampler-1").is_null()) << "the sampler of that name is still there";
  EXPECT_TRUE(wait_until([&] {
    const auto later = ask(master, anna, "status");
    return later && value(nlohmann::json::parse(*later), "viewer-1", "updates") > value(now, "viewer-1", "updates");
  })) << "the session goes on";
  EXPECT_TRUE(ask(master, operators, "stop").ok());
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
}

TEST(KeysOfSessions, StrangersAreRefusedAtOnceAndCostNothing) {
  const KeyFolder keys, others;
  PipelineRun run({"--duration", "0", "--keys", keys.path()});
  const std::string master = run.master();
  const net::Access operators = keys.of(Role::kOperator);
  const auto status = [&] {
    const auto text = ask(master, operators, "status");
    return text ? nlohmann::json::parse(*text) : nlohmann::json();
  };
  ASSERT_TRUE(wait_until([&] { return value(status(), "viewer-1", "points") > 0; })) << run.program().err();
  // Without keys, and with others: an error in time, and no hang. The session's file is not theirs.
  const TemporaryFolder folder;
  setenv("TELESPLAT_RUNTIME", (folder / "strangers").c_str(), 1);
  for (const std::vector<std::string>& flags : {std::vector<std::string>{}, {"--keys", others.path()}}) {
    std::vector<std::string> arguments{"ctl", "stop", "--master", master};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    Program stranger("telesplat", arguments, folder / "stranger");
    EXPECT_EQ(stranger.wait(20), 1);
    // Had it waited in vain, it would say that no master answers.
    EXPECT_NE(stranger.err().find("refuses: it "), std::string::npos) << stranger.err();
    EXPECT_EQ(std::ranges::count(stranger.err(), '\n'), 1) << stranger.err();
  }
  {
    Program sampler("telesplat-sampler", {"--master", master}, folder / "sampler");
    EXPECT_EQ(sampler.wait(20), 2) << sampler.err();
    EXPECT_NE(sampler.err().find("it wants a key (--keys DIR)"), std::string::npos) << sampler.err();
  }
  const auto before = status();
  std::vector<std::string> endpoints{master};
  for (const auto& p : before["processes"])
    if (p.contains("endpoints"))
      for (const auto& [key, address] : p["endpoints"].items()) endpoints.push_back(address);
  const int kStrangers = 200;
  {
    net::Context with(others.of(Role::kOperator)), without;
    std::deque<net::Socket> strangers;
    for (int i = 0; i < kStrangers; ++i) {
      strangers.emplace_back(i % 2 ? with : without, net::Kind::kDealer, "stranger",
                             net::SocketOptions{.linger_ms = 0});
      ASSERT_TRUE(strangers.back().connect(endpoints[size_t(i) % endpoints.size()]).ok());
      strangers.back().send_frames({}, "control", "let me in");
    }
    EXPECT_TRUE(wait_until([&] { return status()["keys_refused"] >= kStrangers / int(endpoints.size()) - 1; }));
  }
  const auto now = status();
  EXPECT_EQ(now["messages_rejected"], before["messages_rejected"]);
  EXPECT_TRUE(wait_until([&] {
    const auto s = status();
    return value(s, "viewer-1", "frames") > value(now, "viewer-1", "frames") &&
           value(s, "viewer-1", "updates") > value(now, "viewer-1", "updates");
  }));
  EXPECT_TRUE(ask(master, operators, "stop").ok());
  EXPECT_EQ(run.program().wait(60), 0) << run.program().err();
  EXPECT_EQ(run.program().err().find("died"), std::string::npos) << run.program().err();
  EXPECT_GE(run.summary()["errors"]["keys_refused"], kStrangers / 2);
  EXPECT_EQ(run.summary()["errors"]["messages_rejected"], 0);
}

// Commands that need no flag from the person who started the run.
TEST(KeysOfSessions, TheOwnerOfARunNeedsNoKeysFlag) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const std::string master = run.master();
  EXPECT_EQ(ask(master, {}, "status").ok(), false) << "it has keys";
  const TemporaryFolder folder;
  const std::vector<std::string> at_master{"--master", master};
  const auto expect_done = [&](const std::string& program, std::vector<std::string> arguments) {
    for (const auto& where : {std::vector<std::string>{}, at_master}) {
      auto all = arguments;
      all.insert(all.end(), where.begin(), where.end());
      if (where.empty() && program != "telesplat") all.insert(all.end(), {"--master", "auto"});
      Program p(program, all, folder / "program");
      EXPECT_EQ(p.wait(60), 0) << program << " " << arguments.front() << ": " << p.err();
    }
  };
  expect_done("telesplat", {"ctl", "status"});
  expect_done("telesplat", {"ctl", "coupling", "async"});
  expect_done("telesplat-health", {"--role", "sampler"});
  Program joined("telesplat",
                 {"run", "--master", master, "--size", "160x100", "--frames", "20", "--out", folder / "run"},
                 folder / "joined");
  EXPECT_EQ(joined.wait(60), 0) << joined.err();
  Program sampler("telesplat-sampler", {"--master", master, "--name", "by-hand", "--threads", "1"}, folder / "sampler");
  EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "by-hand", "tiles_sampled") > 0; }));
  EXPECT_EQ(run.stop(), 0) << run.program().err();
}

// Another person on this machine: only root can be one.
TEST(KeysOfSessions, AnotherUserIsRefusedInASentence) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can run programs as another user";
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const std::string master = run.master();
  const TemporaryFolder folder;
  const auto as_nobody = [&](std::vector<std::string> command) {
    command.insert(command.begin(), {"--reuid=65534", "--regid=65534", "--clear-groups", "--"});
    Program p("/usr/bin/setpriv", command, folder / "nobody");
    EXPECT_EQ(p.wait(30), 1) << p.out() << p.err();
    return p.err();
  };
  const std::string telesplat = TELESPLAT_BIN "/telesplat";
  for (const char* order : {"status", "stop"})
    EXPECT_EQ(as_nobody({telesplat, "ctl", order, "--master", master}),
              "telesplat: the master at " + master + " refuses: it wants a key (--keys DIR)\n");
  EXPECT_TRUE(as_nobody({telesplat, "ctl", "status"}).starts_with("telesplat: no session of yours runs"));
  EXPECT_NE(as_nobody({"/bin/cat", run.access().keys()->folder + "/operator.key"}).find("denied"), std::string::npos);
  // Nor do sockets without a key, of a program of theirs, get anything.
  const auto before = run.status();
  net::Context context;
  std::deque<net::Socket> strangers;
  for (const auto& [key, kind] : {std::pair{"patches", net::Kind::kSub}, {"state", net::Kind::kDealer}}) {
    strangers.emplace_back(context, kind, "stranger", net::SocketOptions{.linger_ms = 0});
    ASSERT_TRUE(strangers.back().connect(process(before, "packer")["endpoints"][key]).ok());
  }
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "packer", "keys_refused") >= 2 &&
           value(s, "viewer-1", "updates") > value(before, "viewer-1", "updates") + 3;
  }));
  for (net::Socket& s : strangers) EXPECT_FALSE(s.receive());
  EXPECT_EQ(run.stop(), 0) << run.program().err();
}

// Keys of --keys auto, which is the default.
TEST(KeysOfSessions, FilesAreTheirOwnersAloneAndGoWithTheirRuns) {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  const std::string runtime = folder / "runtime";
  setenv("TELESPLAT_RUNTIME", runtime.c_str(), 1);
  std::string left;
  {
    PipelineRun killed({"--duration", "0"});
    ASSERT_TRUE(killed.wait_showing()) << killed.program().err();
    left = killed.access().keys()->folder;
    for (const auto& entry : fs::recursive_directory_iterator(runtime)) {
      const auto others = entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all);
      EXPECT_TRUE(others == fs::perms::none || entry.path().extension() == ".pub") << entry.path();
    }
    EXPECT_EQ(fs::status(runtime).permissions(), fs::perms::owner_all);
    killed.program().signal(SIGKILL);
    killed.program().wait(20);
    EXPECT_TRUE(killed.all_gone());
  }
  ASSERT_TRUE(fs::exists(left));
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::minutes(5));
  PipelineRun next({"--duration", "0"});
  ASSERT_TRUE(next.wait_showing()) << next.program().err();
  EXPECT_FALSE(fs::exists(left)) << "the next run removes it";
  EXPECT_TRUE(fs::exists(next.access().keys()->folder));
  // The session's file names them, so that the person who started it needs no flag.
  Program status("telesplat", {"ctl", "status", "--json"}, folder / "status");
  EXPECT_EQ(status.wait(), 0) << status.err();
  EXPECT_NE(status.out().find(runtime + "/keys-"), std::string::npos) << status.out();
  Program stop("telesplat", {"ctl", "stop"}, folder / "stop");
  EXPECT_EQ(stop.wait(), 0) << stop.err();
  EXPECT_EQ(next.program().wait(60), 0) << next.program().err();
  unsetenv("TELESPLAT_RUNTIME");
  for (const auto& entry : fs::directory_iterator(runtime))
    EXPECT_FALSE(entry.path().filename().string().starts_with("keys-")) << entry.path();
}

// A session whose viewer is behind a link, and viewers outside that come through a SOCKS tunnel as `ssh -D` makes it.
TEST(KeysOfSessions, TunnelsCarryThoseWithKeysAndNobodyElse) {
  const KeyFolder keys, others;
  const TemporaryFolder folder;
  ASSERT_TRUE(keys.maker().add_person("anna", Role::kViewer).ok());
  Program bundle("telesplat", {"keys", keys.path(), folder / "laptop", "--bundle", "anna"}, folder / "bundle");
  ASSERT_EQ(bundle.wait(20), 0) << bundle.err();
  PipelineRun run({"--duration", "0", "--keys", keys.path(), "--link", "rtt=20ms"});
  run.use_keys(keys.path(), keys.of(Role::kOperator));
  const std::string master = run.master();
  ASSERT_TRUE(run.wait_status([](const auto& s) {
    return value(s, "viewer-1", "updates") > 3 && value(s, "viewer-1", "rtt_ms") >= 20;
  })) << run.program().err();

  Program tunnel("telesplat-wan-relay", {"--socks", "127.0.0.1:*"}, folder / "tunnel");
  ASSERT_TRUE(wait_until([&] { return tunnel.out().find('\n') != std::string::npos; })) << tunnel.err();
  const std::string line = tunnel.out().substr(0, tunnel.out().find('\n')), words = "listening on ";
  ASSERT_NE(line.find(words), std::string::npos) << line;
  const std::string via = line.substr(line.find(words) + words.size());
  const auto viewer = [&](const std::string& name, const std::string& key_folder) {
    return std::vector<std::string>{"--master", master,     "--via", via,      "--keys",  key_folder, "--name",
                                    name,       "--frames", "120",   "--size", "320x200", "--out",    folder / name};
  };
  Program stranger("telesplat-viewer", viewer("stranger", others.path()), folder / "stranger-viewer");
  Program anna("telesplat-viewer", viewer("anna", folder / "laptop"), folder / "anna-viewer");
  EXPECT_EQ(anna.wait(60), 0) << anna.err();
  // A connection that breaks off may be a tunnel whose other end is not there yet: so a stranger tries on and says why.
  EXPECT_TRUE(wait_until([&] { return stranger.err().find("does not let stranger in") != std::string::npos; }))
      << stranger.err();
  stranger.signal(SIGTERM);
  EXPECT_GE(stranger.wait(60), 0) << "it ends when it is told to: " << stranger.err();

  // A packer that is started again has other ports, and knows who may come in.
  const auto before = run.status();
  const pid_t victim = process(before, "packer").value("pid", pid_t{0});
  ASSERT_GT(victim, 0);
  ::kill(victim, SIGKILL);
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    const auto packer = process(s, "packer");
    return packer.is_object() && packer.value("pid", victim) != victim &&
           value(s, "viewer-1", "updates") > value(before, "viewer-1", "updates") + 3;
  })) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const std::string updates = read_text(run.out() + "/updates.csv");
  EXPECT_NE(updates.find("\nanna,"), std::string::npos) << "views were made for her";
  EXPECT_EQ(updates.find("\nstranger,"), std::string::npos);
  EXPECT_EQ(run.summary()["errors"]["messages_rejected"], 0);
  EXPECT_GE(run.summary()["errors"]["keys_refused"], 1);
  EXPECT_TRUE(run.all_gone());
}

TEST(KeysOfSessions, BadFoldersAreRefusedInALine) {
  const KeyFolder keys;
  const TemporaryFolder folder;
  std::filesystem::permissions(keys.path() + "/sampler.key", std::filesystem::perms(0644));
  for (const auto& [program, arguments, why] :
       std::vector<std::tuple<std::string, std::vector<std::string>, std::string>>{
           {"telesplat-sampler", {"--keys", keys.path()}, "others may read this secret key"},
           {"telesplat-sampler", {"--keys", folder / "none"}, "cannot be opened as a folder of keys"},
           {"telesplat-master", {"--keys", folder.path(), "--bind", "tcp://127.0.0.1:*"}, "server.key: cannot be read"},
           {"telesplat", {"run", "julia", "--keys", folder.path(), "--out", folder / "run"}, "server.pub"},
           {"telesplat", {"ctl", "status", "--master", "tcp://127.0.0.1:9", "--keys", folder.path()}, "server.pub"},
           {"telesplat-health", {"--keys", folder.path()}, "server.pub"}}) {
    Program p(program, arguments, folder / "program");
    EXPECT_EQ(p.wait(20), 2) << program << ": " << p.err();
    EXPECT_NE(p.err().find(why), std::string::npos) << program << ": " << p.err();
    EXPECT_EQ(std::ranges::count(p.err(), '\n'), 1) << program << ": " << p.err();
  }
}

}  // namespace
}  // namespace telesplat::test
