// `telesplat report` as a person has it: its page opens in a browser without an error, for runs of all kinds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/image/file.h"
#include "tests/integration/commands/here.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

Said report(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "report");
  return telesplat(arguments);
}

std::string browser() {
  for (const char* name : {"chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"})
    if (const std::string path = launcher::find_program(name); !path.empty()) return path;
  return {};
}

constexpr const char* kNoBrowser = "no Chromium is installed (Debian: chromium-headless-shell), so no page is opened";

// Returns the page in the browser once all its scripts have run.
std::string opened(const TemporaryFolder& folder, const std::string& page) {
  const std::string command = fmt::format(
      "HOME='{0}' timeout 90 '{1}' --headless --no-sandbox --disable-gpu --user-data-dir='{0}/profile' "
      "--virtual-time-budget=20000 --window-size=1400,2000 --dump-dom 'file://{2}' 2> '{0}/browser.err'",
      folder.path(), browser(), page);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string out;
  std::array<char, 65536> part;
  while (pipe)
    if (const size_t n = fread(part.data(), 1, part.size(), pipe.get()); n > 0)
      out.append(part.data(), n);
    else
      break;
  return out;
}

void expect_no_error(const std::string& dom) {
  EXPECT_NE(dom.find("data-ready=\"yes\""), dom.npos) << "the page's scripts did not come to their end";
  EXPECT_EQ(dom.find("data-errors"), dom.npos) << dom.substr(dom.find("This page has an error"), 400);
}

void write(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

// Tables of a run of `frames` frames, `slow` times as slow; names that would be HTML if they were not escaped.
void write_run(const std::string& directory, int frames, double slow) {
  std::string shown =
      "viewer,frame,t_s,inter_frame_ms,construction_ms,points_drawn,points_cached,update_age_ms,view_error_m,"
      "view_error_deg,px,py,pz,qw,qx,qy,qz,begin_s\n";
  std::string updates = "viewer,request,frame,requested_s,complete_s,latency_ms,start_up_ms,points,extra_points\n";
  std::string stages =
      "viewer,request,frame,tile,requested_s,sampling_ms,tile_network_ms,view_queue_ms,"
      "latency_ms,display_ms,patches\n";
  std::string tiles = "frame,tile,sampler,samples,kept,bytes_sent,encode_end_s,packed_s,published_s\n";
  std::string trace = "[\n{\"ph\":\"M\",\"name\":\"process_name\",\"pid\":5,\"args\":{\"name\":\"viewer-<b>1</b>\"}}";
  for (int i = 0; i < frames; ++i) {
    const double ms = slow * (i % 50 == 7 ? 50 : 16.7), s = 3 + i * 0.0167 * slow;
    shown += fmt::format("<i>v</i>,{},{},{},{},1000,{},{},0.01,0.5,{},0.3,{},1,0,0,0,{}\n", i, s - 3, i ? ms : 0,
                         ms / 2, 5000 + i, 100 + i % 9, std::sin(s), std::cos(s), s);
    trace += fmt::format(
        ",\n{{\"ph\":\"X\",\"name\":\"display frame\",\"pid\":5,\"tid\":0,\"ts\":{},\"dur\":{},"
        "\"args\":{{\"frame\":{}}}}}",
        s * 1e6, ms * 500, i);
    if (i % 4) continue;
    updates += fmt::format("<i>v</i>,{0},{0},{1},{2},60,40,500,5\n", i, s, s + 0.06);
    stages += fmt::format("<i>v</i>,{0},{0},3,{1},40,15,5,60,9,4\n", i, s);
    tiles +=
        fmt::format("{},0,\"s,<script>alert(1)</script>\",4000,500,2000,{},{},{}\n", i, s + 0.03, s + 0.04, s + 0.05);
    trace += fmt::format(
        ",\n{{\"ph\":\"X\",\"name\":\"view update\",\"pid\":5,\"tid\":2,\"ts\":{},\"dur\":60000,"
        "\"args\":{{\"request\":{}}}}}",
        s * 1e6, i);
  }
  write(directory + "/frames.csv", shown);
  write(directory + "/updates.csv", updates);
  write(directory + "/stages.csv", stages);
  write(directory + "/tiles.csv", tiles);
  write(directory + "/quality.csv",
        "frame,t_s,psnr_db,ssim,flip,hole_fraction,object_pixels\n2,0.03,24,0.9,0.1,0.01,9\n"
        "40,0.6,25,0.9,0.1,,9\n");
  write(directory + "/trace.json", trace + "\n]\n");
  write(directory + "/session.toml", "[scene]\nroom_size = 0.8\n# </script><img src=x onerror=alert(1)>\n");
  write(directory + "/logs/packer.log", "12:00:00.000 packer warning <b>full</b>\n");
  write(directory + "/summary.json",
        R"({"scene": "<img src=x onerror=alert(1)>", "kind": "mesh", "primitives": 12, "fps": 55.5, "size": [64, 48],
            "coupling": "async", "inter_frame_delay_ms": {"mean": 17, "median": 16.7, "p95": 50, "p99": 50},
            "errors": {"messages_rejected": 2, "gaps_resynced": 0, "leases_expired": 0}})");
}

std::string attribute(const std::string& dom, const std::string& name) {
  const std::string begin = "data-" + name + "=\"";
  const size_t at = dom.find(begin);
  if (at == dom.npos) return {};
  return dom.substr(at + begin.size(), dom.find('"', at + begin.size()) - at - begin.size());
}

// With a person's hands on it (act.js), which zoom all its charts together.
TEST(Report, OfARunOpensWithoutAnErrorShowsAllItsPartsAndAnswersHands) {
  if (browser().empty()) GTEST_SKIP() << kNoBrowser;
  const TemporaryFolder folder;
  write_run(folder / "run", 600, 1);
  fs::create_directory(folder / "run/images");
  const image::View picture{64, 48, std::vector<uint32_t>(64 * 48, 0x804020), {}};
  ASSERT_TRUE(image::write_png(folder / "run/images/verify-worst-000002.png", picture));
  const Said made = report({folder / "run"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.out.find(folder / "run/report.html"), made.out.npos);
  std::string page = read_text(folder / "run/report.html");
  const std::string act = read_text("tests/integration/commands/act.js");
  ASSERT_FALSE(act.empty());
  page.insert(page.rfind("</body>"), "<script>" + act + "</script>");
  write(folder / "act.html", page);
  const std::string dom = opened(folder, folder / "act.html");
  expect_no_error(dom);
  for (const char* part : {"delay", "stages", "trace", "time", "walk", "measures", "about", "configuration", "errors"})
    EXPECT_NE(dom.find(fmt::format("<section id=\"{}\"", part)), dom.npos) << part;
  EXPECT_NE(dom.find("Beside the reference"), dom.npos);
  // Names are text: the page has no element that a run wrote.
  const std::string shown = dom.substr(dom.find("<main"), dom.find("</main>") - dom.find("<main"));
  EXPECT_NE(shown.find("&lt;img src=x onerror=alert(1)&gt;"), shown.npos);
  EXPECT_EQ(shown.find("<img src=\"x\""), shown.npos);
  EXPECT_EQ(shown.find("<b>full"), shown.npos);

  EXPECT_NE(attribute(dom, "chart").find("ms"), std::string::npos);
  EXPECT_NE(attribute(dom, "histogram").find("%"), std::string::npos);
  EXPECT_NE(attribute(dom, "map").find("position"), std::string::npos);
  EXPECT_EQ(attribute(dom, "toggled"), "true");
  // One span of time in all charts: a part of the run, then all of it, 599 frames of 16.7 ms.
  double from = 0, to = 0;
  ASSERT_EQ(std::sscanf(attribute(dom, "zoomed").c_str(), "%lf %lf", &from, &to), 2);
  EXPECT_EQ(attribute(dom, "zoomed").find('|'), std::string::npos) << attribute(dom, "zoomed");
  EXPECT_GT(from, 0.5);
  EXPECT_LT(to, 9);
  EXPECT_EQ(attribute(dom, "reset"), "0.000 10.003");
}

TEST(Report, OfTwoRunsTellsTheirDifferences) {
  const TemporaryFolder folder;
  write_run(folder / "<b>quick", 300, 1);
  write_run(folder / "slow", 200, 2);
  const Said made = report({folder / "<b>quick", folder / "slow", "--out", folder / "both.html"});
  ASSERT_EQ(made.code, 0) << made.err;
  if (browser().empty()) GTEST_SKIP() << kNoBrowser;
  const std::string dom = opened(folder, folder / "both.html");
  expect_no_error(dom);
  EXPECT_NE(dom.find("2 runs compared"), dom.npos);
  EXPECT_NE(dom.find("&lt;b&gt;quick"), dom.npos);
  EXPECT_NE(dom.find("<section id=\"figures\""), dom.npos);
}

TEST(Report, OfASweepShowsItsRuns) {
  const TemporaryFolder folder;
  write_run(folder / "sweep/a/1", 100, 1);
  write_run(folder / "sweep/a/2", 100, 1.1);
  write_run(folder / "sweep/b/1", 100, 2);
  write(folder / "sweep/sweep.csv",
        "configuration,repetition,flag.coupling,state,reason,noisy,folder\n"
        "a,1,<i>sync</i>,done,,,a/1\na,2,<i>sync</i>,done,,,a/2\nb,1,async,done,,,b/1\nb,2,async,failed,why,,b/2\n");
  const Said made = report({folder / "sweep"});
  ASSERT_EQ(made.code, 0) << made.err;
  if (browser().empty()) GTEST_SKIP() << kNoBrowser;
  const std::string dom = opened(folder, folder / "sweep/report.html");
  expect_no_error(dom);
  EXPECT_NE(dom.find("<section id=\"sweep\""), dom.npos);
  EXPECT_NE(dom.find("async, run 2: why"), dom.npos);
  EXPECT_NE(dom.find("&lt;i&gt;sync&lt;/i&gt;"), dom.npos);
}

TEST(Report, OfARunThatBrokeOffOpensAndSaysWhatItLacks) {
  if (browser().empty()) GTEST_SKIP() << kNoBrowser;
  const TemporaryFolder folder;
  write_run(folder / "run", 50, 1);
  for (const char* file : {"summary.json", "stages.csv", "quality.csv", "session.toml", "trace.json"})
    fs::remove(folder / (std::string("run/") + file));
  write(folder / "run/updates.csv", "viewer,request");
  ASSERT_EQ(report({folder / "run"}).code, 0);
  const std::string dom = opened(folder, folder / "run/report.html");
  expect_no_error(dom);
  EXPECT_NE(dom.find("summary.json is not there"), dom.npos);
  EXPECT_NE(dom.find("trace.json is not there"), dom.npos);
  // With nothing at all but its id.
  write(folder / "empty/run.id", "telesplat-run 0123456789abcdef\n");
  ASSERT_EQ(report({folder / "empty"}).code, 0);
  expect_no_error(opened(folder, folder / "empty/report.html"));
}

TEST(Report, OfTenMinutesStaysSmallAndOpens) {
  const TemporaryFolder folder;
  write_run(folder / "run", 36'000, 1);
  const Said made = report({folder / "run"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_LT(fs::file_size(folder / "run/report.html"), 15'000'000u);
  if (browser().empty()) GTEST_SKIP() << kNoBrowser;
  const std::string dom = opened(folder, folder / "run/report.html");
  expect_no_error(dom);
  EXPECT_NE(dom.find("Thinned: "), dom.npos) << "the page does not say that it leaves something out";
}

TEST(Report, RefusesAFolderThatIsNoRunAndWritesThroughNoLink) {
  const TemporaryFolder folder;
  for (const std::string& path : {folder.path(), folder / "not there"}) {
    const Said refused = report({path});
    EXPECT_EQ(refused.code, 2);
    EXPECT_EQ(refused.err, fmt::format("telesplat: {}: is no run folder\n", path));
  }
  // Nothing but what its own folder holds is written: a report of a stranger's run, too.
  const fs::path run = folder / "run";
  write(run / "summary.json", "{}"), write(run / "frames.csv", "viewer,t_s\nviewer-1,0\n");
  write(folder / "precious", "precious");
  for (const char* name : {"report.html", "report.html.part"}) fs::create_symlink(folder / "precious", run / name);
  EXPECT_EQ(report({run}).code, 0);
  EXPECT_EQ(read_text(folder / "precious"), "precious");
  EXPECT_FALSE(fs::is_symlink(run / "report.html"));
  EXPECT_TRUE(read_text(run / "report.html").starts_with("<!DOCTYPE html>"));
}

}  // namespace
}  // namespace telesplat::test
