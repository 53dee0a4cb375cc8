// make-keys: what `telesplat keys DIR` makes, as a program that is small enough for the images of containers.
#include <cstdio>

#include "common/core/version.h"
#include "common/net/keys/key_maker.h"
#include "common/net/service.h"
#include "common/options/parser.h"
#include "tools/common/complain.h"

using namespace telesplat;

namespace {

constexpr const char* kAbout =
    "Makes a folder of keys as telesplat keys does: those of the server and of each role, as far as they are not "
    "there.";

int make(const std::string& folder) {
  auto maker = net::KeyMaker::open(folder);
  if (!maker) return tools::complain(maker.error(), 2, "make-keys");
  const auto made = maker->make_missing();
  if (!made) return tools::complain(made.error(), 1, "make-keys");
  for (const std::string& name : *made) std::printf("%s\n", name.c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] {
    std::string folder;
    options::Parser parser(kAbout);
    parser.add({{.flag = "folder", .value = &folder, .help = "folder of keys", .required = true}});
    parser.version(version());
    parser.parse_or_exit("make-keys", {argv + 1, argv + argc});
    return make(folder);
  });
}
