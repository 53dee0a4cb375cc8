// --metrics-port: figures for Prometheus, read by its own client's parser.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

int free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  bind(fd, reinterpret_cast<sockaddr*>(&at), size);
  getsockname(fd, reinterpret_cast<sockaddr*>(&at), &size);
  close(fd);
  return ntohs(at.sin_port);
}

// Debian's own, which has the packages that tools/setup installs.
int python(const std::string& script, const std::string& arguments, const std::string& out) {
  return WEXITSTATUS(std::system(("/usr/bin/python3 " + script + " " + arguments + " > " + out + " 2>&1").c_str()));
}

// Reads the page with the parser and checks what must be there. Says how many series there are.
constexpr const char* kScript = R"(
import sys, time, urllib.request
try:
    from prometheus_client.parser import text_string_to_metric_families
except ImportError:
    sys.exit(77)
url = sys.argv[1]
for attempt in range(100):
    text = urllib.request.urlopen(url, timeout=10).read().decode()
    families = {family.name: family for family in text_string_to_metric_families(text)}
    def value(series, **labels):
        for sample in (families.get(series) or families[series.removesuffix("_total")]).samples:
            if sample.name == series and all(sample.labels.get(k) == v for k, v in labels.items()):
                return sample.value
    ready = "telesplat_viewer_frames" in families and "telesplat_viewer_frames_per_second" in families
    if ready and value("telesplat_viewer_frames_total", name="viewer-1") > 5: break
    time.sleep(0.3)
else:
    sys.exit("no figures of the viewer: " + text)
assert families["telesplat_session_info"].samples[0].labels["kind"] == "mesh"
assert value("telesplat_process_up", role="viewer", name="viewer-1") == 1
assert value("telesplat_process_up", role="master", name="master") == 1
assert value("telesplat_process_resident_memory_bytes", role="packer", name="packer") > 1e6
assert value("telesplat_viewer_frames_total", name="viewer-1") > 5
assert value("telesplat_viewer_coupling", name="viewer-1") == 1
assert value("telesplat_sampler_tiles_total", name="sampler-1") > 0
assert 0 < value("telesplat_sampler_busy_seconds_total", name="sampler-1") < 3600
assert value("telesplat_packer_points", name="packer") > 0
assert families["telesplat_viewer_frames"].type == "counter"
for name in ("inter_frame_delay", "update_latency"):
    family = families[f"telesplat_viewer_{name}_seconds"]
    assert family.type == "histogram", family.type
    buckets = [s.value for s in family.samples if s.name.endswith("_bucket")]
    count = [s.value for s in family.samples if s.name.endswith("_count")]
    assert buckets == sorted(buckets) and buckets[-1] == count[0] > 0, buckets
    assert 0 < [s.value for s in family.samples if s.name.endswith("_sum")][0] < 3600
for family in families.values():
    assert family.documentation, family.name
print(sum(len(f.samples) for f in families.values()))
)";

TEST(Metrics, AreReadByPrometheusOwnParser) {
  const int port = free_port();
  PipelineRun run({"--duration", "0", "--coupling", "sync", "--metrics-port", std::to_string(port)});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const std::string script = run.folder() / "check.py", out = run.folder() / "check.out";
  std::ofstream(script) << kScript;
  const int code = python(script, "http://127.0.0.1:" + std::to_string(port) + "/metrics", out);
  if (code == 77) GTEST_SKIP() << "python3-prometheus-client is not installed";
  EXPECT_EQ(code, 0) << read_text(out);

  // A port that is in use ends the next one at once, before anything has begun.
  Program second("telesplat-master", {"--bind", "tcp://127.0.0.1:*", "--metrics-port", std::to_string(port)},
                 run.folder() / "second");
  EXPECT_EQ(second.wait(), 2);
  EXPECT_EQ(second.err(), "telesplat: --metrics-port " + std::to_string(port) +
                              ": 127.0.0.1 cannot be bound: Address already in use\n");
  EXPECT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_EQ(run.summary()["errors"]["messages_rejected"], 0);
}

}  // namespace
}  // namespace telesplat::test
