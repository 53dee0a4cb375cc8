// A session's status for people: every figure in its place; missing or nonsensical fields break nothing.
#include "tools/telesplat/control/status_text.h"

#include <gtest/gtest.h>

#include "tools/telesplat/run/live_figures.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

Json volume_status() {
  return Json::parse(R"({
  "session": {"address": "tcp://127.0.0.1:4711", "pid": 77, "scene": "head.mha", "kind": "volume",
              "started_at": "2026-11-22T19:54:26Z", "started_by": "view", "run_folder": ""},
  "epoch": 3, "frames_completed": 36, "frames_in_flight": 2, "leases_expired": 1, "tiles_released": 4,
  "leases_backup": 5, "parameters": {"volume.size.x": 512}, "animation": "on",
  "volume": {"transfer": "0:#000000:0,255:#ffffff:1", "step": 2, "steps": 12, "layers": 16, "partitions": 2,
             "partition": {"number": 2, "in_use": true, "ready": false, "spare": ["sampler-9"], "slabs": [
               {"sampler": "sampler-1", "begin": 0, "end": 40, "weight": 1500000, "ready": true, "voxels": 1500000,
                "bytes": 2000000},
               {"sampler": "sampler-2", "begin": 40, "end": 99, "weight": 1400000, "ready": false, "voxels": 0,
                "bytes": 0}]}},
  "processes": [
    {"role": "sampler", "name": "sampler-1", "alive": true, "silent_s": 0.24, "leases": 1, "facts": {"host": "a",
     "threads": "2"}, "values": {"tiles_sampled": 303, "rss_mb": 101.7, "voxel_mb": 6.2}, "rates": {"tiles_sampled": 8, "busy_s": 0.97}},
    {"role": "sampler", "name": "sampler-2", "alive": true, "silent_s": 4.5, "facts": {"host": "b"}},
    {"role": "sampler", "name": "sampler-3", "alive": false, "silent_s": 9},
    {"role": "viewer", "name": "viewer-1", "alive": true, "silent_s": 0.5, "facts": {"host": "a", "width": "640",
     "height": "400"}, "values": {"frames": 1200, "points": 0, "pixels": 1250000, "messages_rejected": 0,
     "inter_frame_ms": 16.7, "inter_frame_p95_ms": 20.14, "update_latency_ms": 137, "update_latency_p95_ms": 186,
     "update_age_ms": 210, "coupling": 2, "buffers": 3, "waits_s": 0, "rtt_ms": 40, "backlog_bytes": 1500},
     "rates": {"frames": 59.94}}]})");
}

TEST(StatusText, HasEveryFigureInItsPlace) {
  const double begin = read_utc("2026-11-22T19:54:26Z");
  EXPECT_EQ(begin, 1795377266);
  EXPECT_EQ(status_text(volume_status(), begin + 75),
            "head.mha (volume), started by telesplat view at " + local_time(begin, begin + 75) +
                ", 75 s ago\n"
                "  address     tcp://127.0.0.1:4711, process 77\n"
                "  record      none\n"
                "  views       36 complete, 2 in flight; epoch 3\n"
                "  leases      1 expired, 5 given to a second sampler; 4 tiles taken back\n"
                "  animation   on\n"
                "  volume      step 2 of 12 (0 to 11), 16 layers; cut into slabs 2 times\n"
                "  transfer    0:#000000:0,255:#ffffff:1\n"
                "\n"
                "slab of      slices  visible voxels  voxels held  MB received\n"
                "sampler-1   0 to 39         1500000      1500000          2.0  ready\n"
                "sampler-2  40 to 98         1400000            0          0.0  being filled\n"
                "sampler-9                                                      spare\n"
                "\n"
                "viewer    host     size  coupling   fps   delay ms  view ms  age ms  M pixels   heard of\n"
                "viewer-1  a     640x400  loose(3)  59.9  16.7/20.1  137/186     210      1.25  0.5 s ago\n"
                "\n"
                "sampler    host  threads  leases  busy  tiles/s  tiles  voxel MB   MB          heard of\n"
                "sampler-1  a           2       1  97 %      8.0    303         6  102         0.2 s ago\n"
                "sampler-2  b                                                           silent for 4.5 s\n"
                "\n"
                "link of   rtt ms  backlog kB\n"
                "viewer-1   40.00         1.5\n"
                "\n"
                "left: sampler-3\n");
}

TEST(StatusText, LimitsAndAFullDiskAreToldWhereTheyBit) {
  Json status = volume_status();
  status["limits"] = {{"max_peers", 512},         {"views_coarser", 3},       {"hellos_refused", 0},
                      {"messages_refused", 1200}, {"connections_refused", 7}, {"queue_refused", 2}};
  status["record_failed"] = {"trace.json", "tiles.csv"};
  const std::string text = status_text(status, 0);
  EXPECT_NE(text.find("  limits      3 views sampled coarser, 1200 messages dropped, 7 connections refused, "
                      "2 answers dropped that nobody read\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("  disk full   2 files of the record cannot be written\n"), std::string::npos) << text;
  EXPECT_EQ(status_text(volume_status(), 0).find("limits"), std::string::npos);
}

TEST(StatusText, NamesDoNotSteerATerminal) {
  Json status = volume_status();
  status["session"]["scene"] = "\x1b]0;owned\x07";
  status["processes"][3]["name"] = "v\x1b[2J\nsampler-7  a";
  status["processes"][2]["name"] = "gone\r\x9b";
  const std::string text = status_text(status, 0);
  for (const char bad : {'\x1b', '\x07', '\r'}) EXPECT_EQ(text.find(bad), std::string::npos) << text;
  EXPECT_EQ(text.find("\nsampler-7"), std::string::npos) << "no line of its own: " << text;
}

TEST(StatusText, ParametersOfAJuliaSetTakeAsManyLinesAsTheyNeed) {
  Json status{{"parameters", Json::object()}};
  for (int i = 0; i < 20; ++i) status["parameters"]["parameter-" + std::to_string(i)] = i / 3.0;
  const std::string text = status_text(status, 0);
  size_t lines = 0, begin = 0;
  for (size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1, ++lines)
    EXPECT_LE(end - begin, 110u);
  EXPECT_GT(lines, 5u);
  EXPECT_NE(text.find("parameter-7 2.3333"), std::string::npos) << text;
}

TEST(StatusText, ManyThatLeftAreNotAllNamed) {
  Json processes = Json::array();
  for (int i = 0; i < 100; ++i)
    processes.push_back({{"role", "sampler"}, {"name", "sampler-" + std::to_string(i)}, {"alive", false}});
  EXPECT_EQ(process_tables(processes),
            "\nleft: sampler-0, sampler-1, sampler-2, sampler-3, sampler-4, sampler-5, sampler-6, sampler-7 and 92 "
            "more\n");
}

TEST(StatusText, ClocksAreToldWhereTheyAreNotTheMasters) {
  const auto processes = [](double offset_ms, double error_ms) {
    return Json::array({{{"role", "packer"},
                         {"name", "packer"},
                         {"alive", true},
                         {"values", {{"clock_offset_ms", offset_ms}, {"clock_error_ms", error_ms}}}}});
  };
  EXPECT_EQ(process_tables(processes(0, 0)).find("clock"), std::string::npos) << process_tables(processes(0, 0));
  const std::string text = process_tables(processes(-5000, 0.21));
  EXPECT_NE(text.find("clock ms"), std::string::npos) << text;
  EXPECT_NE(text.find("-5000.00 ± 0.21"), std::string::npos) << text;
}

TEST(StatusText, AKindThatTheSceneNamesIsNotSaidTwice) {
  Json status = volume_status();
  status["session"]["scene"] = "julia (coral)";
  status["session"]["kind"] = "julia";
  EXPECT_TRUE(status_text(status, 0).starts_with("julia (coral), started")) << status_text(status, 0);
  status["session"]["scene"] = status["session"]["kind"] = "";
  EXPECT_TRUE(status_text(status, 0).starts_with("no data server yet, started")) << status_text(status, 0);
}

TEST(StatusText, WhatAMeshIsColouredByIsTold) {
  const Json status{
      {"colouring", {{"array", "temperature"}, {"unit", "K"}, {"lo", 273.15}, {"hi", 1e5}, {"map", "viridis"}}}};
  EXPECT_NE(status_text(status, 0).find("  coloured by temperature, 273.15 to 100000 K, viridis\n"), std::string::npos)
      << status_text(status, 0);
}

TEST(ViewerResults, AreOfTheNamedViewersThoughTheyLeft) {
  const auto status = nlohmann::json::parse(R"({"processes": [
    {"role": "viewer", "name": "viewer-1", "alive": true, "values": {"frames": 7}},
    {"role": "viewer", "name": "viewer-1-a-5", "alive": false, "rates": {"frames": 58.71}, "values": {"frames": 285,
     "updates": 34, "points": 90000, "bytes_received": 1234567}}]})");
  EXPECT_EQ(viewer_results(status, {"viewer-1-a-5", "viewer-2-a-6"}),
            std::vector<std::string>{
                "viewer-1-a-5: 285 frames, 58.7 fps at the end, 34 view updates, 0.09 M points at the end, "
                "1.2 MB received"});
  EXPECT_TRUE(viewer_results(nlohmann::json::object(), {"viewer-1"}).empty());
}

// The status of a master of another version, or of a program that only looks like one.
TEST(StatusText, NonsenseIsPassedOver) {
  EXPECT_EQ(status_text(Json(), 0), "");
  const Json good = volume_status();
  const Json wrongs[] = {Json(), Json(-1e300), Json("x"), Json::array({1, nullptr}), Json{{"slabs", 1}}};
  for (const auto& [key, value] : good.items())
    for (const Json& wrong : wrongs) {
      Json status = good;
      status[key] = wrong;
      EXPECT_FALSE(status_text(status, 0).empty()) << key;
    }
  for (const auto& [key, value] : good["processes"][0].items())
    for (const Json& wrong : wrongs) {
      Json status = good;
      status["processes"][0][key] = wrong;
      EXPECT_FALSE(status_text(status, 0).empty()) << key;
    }
  for (const Json& wrong : wrongs) {
    Json status = good;
    status["volume"]["partition"]["slabs"] = wrong;
    status["volume"]["partition"]["spare"] = wrong;
    EXPECT_FALSE(status_text(status, 0).empty());
    for (const auto& [key, value] : good["volume"]["partition"]["slabs"][0].items()) {
      status = good;
      status["volume"]["partition"]["slabs"][0][key] = wrong;
      EXPECT_FALSE(status_text(status, 0).empty()) << key;
    }
  }
}

TEST(StatusText, TimesAreRead) {
  EXPECT_EQ(read_utc("1970-01-01T00:00:10Z"), 10);
  for (const char* wrong : {"", "now", "1970-01-01T00:00:10", "1970-01-01T00:00:10Z and more"})
    EXPECT_EQ(read_utc(wrong), 0) << wrong;
}

}  // namespace
}  // namespace telesplat::launcher
