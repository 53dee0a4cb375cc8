// The page of a report: its content for complete, broken and strange runs; no text of a run becomes code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/core/utf8.h"
#include "common/image/file.h"
#include "tools/telesplat/movie/contact_sheet.h"
#include "tools/telesplat/report/page.h"
#include "tools/telesplat/report/parts.h"
#include "tools/telesplat/report/report.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-report-XXXXXX").string();
    if (mkdtemp(pattern.data())) path_ = pattern;
  }
  ~TemporaryFolder() { fs::remove_all(path_); }
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

void write(const std::string& path, const std::string& text) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

const std::string kFrames =
    "viewer,frame,t_s,inter_frame_ms,construction_ms,points_drawn,points_cached,update_age_ms,view_error_m,"
    "view_error_deg,px,py,pz,qw,qx,qy,qz,begin_s\n"
    "viewer-1,0,0,0,5,10,100,200,0.001,0.1,0,0,1,1,0,0,0,2\n"
    "viewer-1,1,0.02,20,5,10,100,220,0.002,0.1,0,0,1,1,0,0,0,2.02\n"
    "viewer-1,2,0.03,10,5,10,100,230,0.002,0.1,0.1,0,1,1,0,0,0,2.03\n";

TEST(ReportPage, EscapesText) {
  EXPECT_EQ(html_escaped("<b>\"a\" & 'b'</b>"), "&lt;b&gt;&quot;a&quot; &amp; &#39;b&#39;&lt;/b&gt;");
  EXPECT_EQ(html_escaped("a\xff"), "a\xef\xbf\xbd");
}

TEST(ReportPage, JsonEndsNoScriptAndReadsBackAsItWas) {
  const nlohmann::ordered_json data{{"name", "</script><!-- <script>&\xe2\x80\xa8\xe2\x80\xa9 \"quoted\" \xc3\xa9"}};
  const std::string text = script_json(data);
  EXPECT_EQ(text.find_first_of("<>&"), text.npos);
  EXPECT_EQ(text.find("\xe2\x80\xa8"), text.npos);
  EXPECT_EQ(nlohmann::ordered_json::parse(text), data);
  EXPECT_TRUE(valid_utf8(script_json({{"bad", "\xff"}})));
}

TEST(ReportPage, HoldsWhatItNeedsAndAsksForNothing) {
  const std::string page = page_html("a <run>", {{"runs", "{{CODE}} {{DATA}}"}});
  EXPECT_NE(page.find("<title>a &lt;run&gt;</title>"), page.npos);
  EXPECT_NE(page.find(R"({"runs":"{{CODE}} {{DATA}}"})"), page.npos) << "what takes a mark's place is not looked at";
  EXPECT_NE(page.find("Dygraph"), page.npos);
  for (const char* asks : {"src=\"http", "href=\"http", "@import", "<link"}) EXPECT_EQ(page.find(asks), page.npos);
}

TEST(ReportRun, WithoutASummaryIsToldFromItsTables) {
  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames + "viewer-1,3,0.05,2");
  const auto run = run_json(folder.path(), "r", 1);
  EXPECT_FALSE(run.at("finished").get<bool>());
  EXPECT_EQ(run.at("spreads").at("inter_frame_ms").at("n"), 2);
  EXPECT_NEAR(run.at("figures").at("delay_median").get<double>(), 15, 1e-9);
  EXPECT_NEAR(run.at("figures").at("fps").get<double>(), 2 / 0.03, 0.01);
  EXPECT_EQ(run.at("series").at("inter_frame_ms")[0].at("v").dump(), "[20.0,10.0]");
  EXPECT_EQ(run.at("series").at("inter_frame_ms")[0].at("t").dump(), "[0.02,0.03]") << "from the first frame on";
  EXPECT_TRUE(run.at("stages").is_null());
  EXPECT_TRUE(run.at("trace").is_null());
  const std::string notes = run.at("notes").dump();
  for (const char* told : {"summary.json", "updates.csv is not there", "stages.csv is not there", "1 line is cut off"})
    EXPECT_NE(notes.find(told), notes.npos) << told;
}

// A stranger's run folder may link to any file on the reader's disk, and pages are passed on.
TEST(ReportRun, NothingIsReadThroughLinks) {
  const TemporaryFolder folder;
  const std::string run = folder / "run", mine = folder / "mine";
  write(mine + "/frames.csv", kFrames);
  write(mine + "/summary.json", R"({"scene": "secret-scene"})");
  write(mine + "/session.toml", "secret = true\n");
  write(mine + "/logs/master.log", "12:00:00.000 master error secret\n");
  image::View view{2, 1, {0xff0000, 0x00ff00}, {}};
  fs::create_directories(mine + "/images");
  ASSERT_TRUE(image::write_png(mine + "/images/frame-000000.png", view));
  const auto empty = [](const nlohmann::ordered_json& page) {
    EXPECT_TRUE(page.at("config").is_null());
    EXPECT_TRUE(page.at("logs").empty());
    EXPECT_EQ(page.at("pictures").at("of"), 0);
    EXPECT_FALSE(page.at("finished").get<bool>());
    EXPECT_EQ(page.dump().find("secret"), std::string::npos);
    EXPECT_NE(page.at("notes").dump().find("frames.csv is a symbolic link and not looked into"), std::string::npos)
        << page.at("notes");
  };
  EXPECT_FALSE(run_json(mine, "r", 1).at("config").is_null());
  fs::create_directory(run);
  for (const char* name : {"frames.csv", "summary.json", "session.toml", "logs", "images"})
    fs::create_symlink(mine + "/" + name, run + "/" + name);
  auto page = run_json(run, "r", 1);
  empty(page);
  EXPECT_NE(page.at("notes").dump().find("5 symbolic links are not looked into, such as frames.csv"), std::string::npos)
      << page.at("notes");
  for (const char* name : {"logs/master.log", "images/frame-000000.png"}) {
    fs::remove(fs::path(run + "/" + name).parent_path());
    fs::create_directory(fs::path(run + "/" + name).parent_path());
    fs::create_symlink(mine + "/" + name, run + "/" + name);
  }
  empty(run_json(run, "r", 1));
  // A link to the folder itself, such as runs/latest, works like its name.
  fs::create_directory_symlink(mine, folder / "latest");
  page = run_json(folder / "latest", "r", 1);
  EXPECT_FALSE(page.at("config").is_null());
  EXPECT_EQ(page.at("pictures").at("of"), 1);
}

TEST(ReportRun, FramesOfAPictureThatStandsAreNoDelays) {
  const TemporaryFolder folder;
  write(folder / "frames.csv",
        "viewer,frame,t_s,inter_frame_ms,construction_ms,begin_s,motion_to_photon_ms,still\n"
        "viewer-1,0,0,0,5,2,9,0\nviewer-1,1,0.02,20,5,2.02,12,0\nviewer-1,2,0.04,20,0,2.04,,1\n"
        "viewer-1,3,0.08,40,9,2.08,30,0\n");
  auto run = run_json(folder.path(), "r", 1);
  EXPECT_EQ(run.at("spreads").at("inter_frame_ms").at("n"), 2);
  EXPECT_EQ(run.at("spreads").at("inter_frame_ms").at("mean"), 30);
  EXPECT_EQ(run.at("spreads").at("motion_to_photon_ms").at("n"), 3);
  EXPECT_EQ(run.at("series").at("motion_to_photon_ms")[0].at("v").dump(), "[9.0,12.0,30.0]");
  EXPECT_NEAR(run.at("figures").at("fps").get<double>(), 2 / 0.06, 0.01);
  run = run_json(folder.path(), "r", 1, {}, 0.03);
  EXPECT_EQ(run.at("spreads").at("inter_frame_ms").at("mean"), 40) << "the beginning is left out";
  EXPECT_EQ(run.at("series").at("motion_to_photon_ms")[0].at("t").dump(), "[0.04]");
  EXPECT_NE(run.at("notes").dump().find("the first 0.03 s are left out"), std::string::npos);
}

TEST(ReportNames, AreLabelsBeforeFolders) {
  const TemporaryFolder folder;
  for (const char* name : {"1", "2"}) write(folder / (name + std::string("/frames.csv")), kFrames);
  write(folder / "2/summary.json", R"({"label": "coupling=sync, run 2"})");
  ReportOptions o{.runs = {folder / "1", folder / "2"}, .labels = {}};
  tools::ProgressLine progress(1);
  const auto page_of = [&](const ReportOptions& options) {
    const auto settled = settle_report(options);
    const auto made =
        settled ? make_report(*settled, progress, [] { return false; }) : Result<ReportMade>(settled.error());
    if (!made) return made.error().text;
    std::ifstream in(made->page);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_NE(page_of(o).find("<title>Telesplat report: 1 and coupling=sync, run 2</title>"), std::string::npos);
  o.labels = {"before", "after"};
  EXPECT_NE(page_of(o).find("<title>Telesplat report: before and after</title>"), std::string::npos);
  o.labels = {"before"};
  EXPECT_EQ(page_of(o), "--label: 1 are given for 2 runs; each run needs one");
}

TEST(ReportRun, OfNothingButItsIdHasNoFiguresAndNoHarm) {
  const TemporaryFolder folder;
  write(folder / "run.id", "telesplat-run 0123456789abcdef\n");
  write(folder / "frames.csv", "viewer,frame,begin_s\n");
  write(folder / "updates.csv", "");
  write(folder / "trace.json", "[\n");
  write(folder / "summary.json", "{\"fps\": ");
  write(folder / "images/frame-000001.png", "no picture");
  write(folder / "images/frame-.png", "no number");
  const auto run = run_json(folder.path(), "r", 1);
  EXPECT_TRUE(run.at("figures").empty());
  EXPECT_TRUE(run.at("walk").is_null());
  EXPECT_EQ(run.at("pictures").at("left_out"), 1);
  EXPECT_FALSE(page_html("r", {{"runs", {run}}}).empty());
}

TEST(ReportRun, ReadsStagesByNameAndChecksThatTheyAddUp) {
  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames);
  write(folder / "stages.csv",
        "viewer,request,frame,further,requested_s,sampling_ms,tile_network_ms,view_queue_ms,latency_ms,display_ms\n"
        "viewer-1,1,7,x,2.01,10,5,5,20,3\nviewer-1,2,8,x,2.02,20,-5,5,20,\n");
  write(folder / "tiles.csv",
        "frame,tile,sampler,published_s\n7,0,early,2.1\n7,1,<i>s</i>,2.3\n7,2,half a block,\n9,0,of another,2.9\n");
  const auto stages = run_json(folder.path(), "r", 1).at("stages");
  EXPECT_EQ(stages.at("of"), 2);
  EXPECT_EQ(stages.at("negative"), 1);
  EXPECT_EQ(stages.at("off"), 0.0);
  ASSERT_EQ(stages.at("stages").size(), 3u);
  EXPECT_EQ(stages.at("stages")[0].at("group"), "queue") << "in the order of the stages, not of the file";
  EXPECT_EQ(stages.at("stages")[1].at("row").at("mean"), 15.0);
  EXPECT_EQ(stages.at("stages")[1].at("row").at("share"), 0.75);
  EXPECT_EQ(stages.at("t").dump(), "[0.01,0.02]");
  EXPECT_EQ(stages.at("sampler")[0], "<i>s</i>") << "who sampled the tile that was published last";
  EXPECT_TRUE(stages.at("sampler")[1].is_null()) << "no ray was cast for it";
  EXPECT_EQ(stages.at("display_row").at("median"), 3.0);
}

TEST(ReportRun, CountsWarningsAndErrorsOfLogs) {
  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames);
  std::string log = "12:00:00.000 master info warning is only a word here\n12:00:00.000 master error <b>\xff\n";
  for (int i = 0; i < 100; ++i) log += "12:00:00.000 master warning again\n";
  write(folder / "logs/master.log", log + "12:00:00.000 master war");
  const auto logs = run_json(folder.path(), "r", 1).at("logs");
  ASSERT_EQ(logs.size(), 1u);
  EXPECT_EQ(logs[0].at("errors"), 1);
  EXPECT_EQ(logs[0].at("warnings"), 100);
  EXPECT_EQ(logs[0].at("lines").size(), 8u);
  EXPECT_TRUE(valid_utf8(logs[0].at("lines")[0].get<std::string>()));
}

TEST(ReportRun, CutsLongLinesOfLogsAndSaysSo) {
  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames);
  const std::string head = "12:00:00.000 master error ";
  const size_t shown = 400;
  write(folder / "logs/a.log", head + std::string(5'000'000, 'x') + "\n" + head + "short\n");
  fs::create_directories(folder / "logs/folder.log");
  const auto logs = run_json(folder.path(), "r", 1).at("logs");
  ASSERT_EQ(logs.size(), 1u) << "a folder is no log";
  EXPECT_EQ(logs[0].at("errors"), 2) << "the rest of a long line is no line of its own";
  const std::string more = std::to_string(head.size() + 5'000'000 - shown);
  EXPECT_EQ(logs[0].at("lines")[0], head + std::string(shown - head.size(), 'x') + " ... (" + more + " bytes more)");
  EXPECT_EQ(logs[0].at("lines")[1], head + "short");
}

TEST(ReportRun, NumbersThatNoRunHasDoNoHarm) {
  const TemporaryFolder folder;
  std::string frames = kFrames;
  const auto columns = std::count(kFrames.begin(), kFrames.begin() + long(kFrames.find('\n')), ',');
  for (const char* strange : {"1e300", "-1e300", "1e18", "-0", "1e-320"}) {
    frames += "v";
    for (long i = 0; i < columns; ++i) frames += std::string(",") + strange;
    frames += "\n";
  }
  write(folder / "frames.csv", frames);
  write(folder / "updates.csv",
        "viewer,request,requested_s,complete_s,latency_ms,points\nv,1,-1e300,1e300,1e300,1e300\nv,2,2,2.01,10,5\n");
  write(folder / "stages.csv", "viewer,request,frame,requested_s,latency_ms,sampling_ms\nv,1,1e300,2,0,0\n");
  write(folder / "summary.json", std::string(100'000, '['));
  write(folder / "trace.json", "[]");
  const auto run = run_json(folder.path(), "r", 1);
  EXPECT_FALSE(run.at("finished").get<bool>());
  EXPECT_LT(run.at("duration_s").get<double>(), 1e4);
  EXPECT_EQ(run.at("trace"), folder / "trace.json");
  const std::string text = script_json(run);
  EXPECT_EQ(nlohmann::ordered_json::parse(text, nullptr, false).is_discarded(), false);
}

TEST(ReportRun, VerifiedFramesFindTheirMomentsWhereAFrameHasNoNumber) {
  const TemporaryFolder folder;
  std::string frames = kFrames;
  frames.replace(frames.find("viewer-1,0,0,"), 13, "viewer-1,?,0,");
  write(folder / "frames.csv", frames);
  write(folder / "quality.csv", "frame,t_s,psnr_db,object_pixels\n?,9,20,9\n2,8,30,9\n");
  const auto psnr = run_json(folder.path(), "r", 1).at("series").at("psnr_db")[0];
  EXPECT_EQ(psnr.at("t").dump(), "[0.03,9.0]");
  EXPECT_EQ(psnr.at("v").dump(), "[30.0,20.0]");
}

TEST(ReportRun, StagesOfNoKnownColumnAreNone) {
  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames);
  write(folder / "stages.csv", "viewer,request,requested_s,latency_ms\nviewer-1,1,2.01,20\n");
  EXPECT_TRUE(run_json(folder.path(), "r", 1).at("stages").is_null());
}

TEST(ReportPictures, AreScaledToMeansAndBounded) {
  image::View view{4, 2, {0x000000, 0xffffff, 0xff0000, 0xff0000, 0x000000, 0xffffff, 0x00ff00, 0x00ff00}, {}};
  const auto small = small_picture(view, 2);
  EXPECT_EQ(small.width, 2);
  EXPECT_EQ(small.height, 1);
  EXPECT_EQ(small.colour[0], 0x808080u);
  EXPECT_EQ(small.colour[1], 0x808000u);
  EXPECT_EQ(small_picture(view, 100).width, 4);

  const TemporaryFolder folder;
  write(folder / "frames.csv", kFrames);
  fs::create_directories(folder / "images");
  for (int i = 0; i < 30; ++i)
    ASSERT_TRUE(image::write_png(folder / ("images/frame-" + std::to_string(100000 + i) + ".png"), view).ok());
  ASSERT_TRUE(image::write_png(folder / "images/verify-worst-000001.png", view).ok());
  const auto told = run_json(folder.path(), "r", 1).at("pictures");
  EXPECT_EQ(told.at("of"), 30);
  EXPECT_EQ(told.at("shown").size(), PageLimits{}.pictures);
  EXPECT_EQ(told.at("shown").back().at("frame"), 100029);
  EXPECT_EQ(told.at("compared")[0].at("name"), "worst");
  EXPECT_NEAR(told.at("compared")[0].at("t").get<double>(), 0.02, 1e-9);
  PageLimits tight;
  tight.picture_bytes = 10;
  EXPECT_EQ(run_json(folder.path(), "r", 1, tight).at("pictures").at("shown").size(), 0u);
}

TEST(ReportPictures, Base64IsRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(ReportOptions, SayWhereThePageGoesAndRefuseWhatIsNoRun) {
  const TemporaryFolder folder;
  write(folder / "a/frames.csv", kFrames);
  write(folder / "b/summary.json", "{}");
  fs::create_directories(folder / "none");
  const auto settled = [](std::vector<std::string> runs, std::string out = "") {
    return settle_report({.runs = std::move(runs), .labels = {}, .out = std::move(out)});
  };
  EXPECT_EQ(settled({folder / "a/"})->out, folder / "a/report.html");
  EXPECT_EQ(settled({folder / "a", folder / "b"})->out, folder / "report.html");
  EXPECT_EQ(settled({folder / "none"}).error().text, (folder / "none") + ": is no run folder");
  EXPECT_FALSE(settled({folder / "a/frames.csv"}).ok());
  EXPECT_FALSE(settled({folder / "a"}, folder / "b").ok());
  EXPECT_FALSE(settled({}).ok());
}

TEST(ReportSweep, ShowsAllRunsAndLaysTheFirstOfEachConfigurationOverTheOthers) {
  const TemporaryFolder folder;
  for (const char* run : {"s/1", "s/2", "a/2"}) {
    write(folder / (run + std::string("/frames.csv")), kFrames);
    write(folder / (run + std::string("/summary.json")),
          R"({"fps": 50, "quality": {"hole_fraction": {"median": 0.5}}})");
  }
  write(folder / "sweep.csv",
        "configuration,repetition,flag.coupling,state,reason,noisy,folder\n"
        "s,1,sync,done,,fps,s/1\ns,2,sync,done,,fps,s/2\na,1,async,failed,\"no, not\",,a/1\na,2,async,done,,,a/2\n"
        "x,1,loose,done,,,../x\nx,2,loose,done,,,/\nx,3,lo");
  write(folder / "cells.csv",
        "configuration,flag.coupling,figure,difference,difference_low,difference_high,p_holm\n"
        "s,sync,fps,,,,\na,async,fps,1,0.5,1.5,0.01\n");
  const auto o = settle_report({.runs = {folder.path()}, .labels = {}});
  ASSERT_TRUE(o.ok()) << o.error().text;
  EXPECT_EQ(o->out, folder / "report.html");
  EXPECT_EQ(o->runs, (std::vector<std::string>{folder / "s/1", folder / "a/2"}));
  EXPECT_EQ(o->labels, (std::vector<std::string>{"coupling=sync", "coupling=async"}));
  const auto& all = o->sweep.at("configurations");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].at("runs").size(), 2u);
  EXPECT_EQ(all[0].at("noisy"), "fps");
  EXPECT_EQ(all[0].at("runs")[1].at("figures").at("holes"), 50);
  EXPECT_EQ(all[1].at("runs")[0].at("reason"), "no, not");
  EXPECT_TRUE(all[2].at("runs")[0].at("figures").empty()) << "it leads out of the sweep";
  ASSERT_EQ(o->sweep.at("differences").size(), 1u);
  EXPECT_EQ(o->sweep.at("differences")[0].at("p"), 0.01);
  tools::ProgressLine progress(1);
  ASSERT_TRUE(make_report(*o, progress, [] { return false; }).ok());
  EXPECT_TRUE(fs::exists(folder / "report.html"));
  write(folder / "sweep.csv", "configuration,state,folder\n");
  EXPECT_EQ(settle_report({.runs = {folder.path()}, .labels = {}}).error().text,
            folder.path() + ": no run of the sweep is done");
}

}  // namespace
}  // namespace telesplat::launcher
