// `telesplat-lab codec FILE...`: bits and speed of the codec of depth images, beside LZW and zstd.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "common/codec/depth_codec.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/lab/codec/measure.h"
#include "tools/lab/commands.h"

namespace telesplat::lab {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMostFileBytes = 256u << 20;

struct CodecOptions {
  std::vector<std::string> files;
};

options::Table table(CodecOptions& o) {
  return {{.flag = "files",
           .value = &o.files,
           .help = "recorded depth images: FILE.depth, or a folder with some in it, such as the run of telesplat run "
                   "--record-depth; a row each",
           .required = true}};
}

// The images that an argument stands for, in order. Error: there are none.
Result<std::vector<std::string>> images_of(const std::string& argument) {
  if (argument.ends_with(".depth")) return std::vector{argument};
  std::vector<std::string> out;
  for (const std::string& folder : {argument, argument + "/depth"}) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error))
      if (entry.path().extension() == ".depth") out.push_back(entry.path().string());
  }
  std::sort(out.begin(), out.end());
  if (out.empty())
    return Error{fmt::format("{}: holds no depth images; telesplat run --record-depth keeps some", argument)};
  return out;
}

Status add_file(const std::string& path, CodecFigures& to) {
  const auto bytes = read_whole(path, kMostFileBytes);
  if (!bytes) return bytes.error();
  const auto image = codec::decode({reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()});
  const Status added = image ? add(*image, to) : Status(image.error());
  return added ? added : Status(Error{fmt::format("{}: {}", path, added.error().text)});
}

int measure(CodecOptions o, const options::Given&) {
  log::initialise("telesplat-lab", "warn");
  net::install_signal_handlers();
  tools::ProgressLine progress;
  std::vector<CodecFigures> all;
  for (const std::string& argument : o.files) {
    const auto files = images_of(argument);
    if (!files) return tools::complain(files.error());
    all.push_back({fs::weakly_canonical(argument).filename().string()});
    for (size_t i = 0; i < files->size(); ++i) {
      if (net::stop_requested()) return tools::complain({"interrupted"}, 130);
      progress.show(fmt::format("{}: image {} of {}", all.back().name, i + 1, files->size()));
      if (const Status s = add_file((*files)[i], all.back()); !s) return tools::complain(s.error());
    }
  }
  progress.close();
  std::fputs(to_markdown(all).c_str(), stdout);
  return 0;
}

}  // namespace

launcher::Command codec_command() {
  return launcher::make_command(
      "codec", "measure bits and speed of the codec of depth images, beside LZW, as the thesis has it, and zstd", table,
      measure);
}

}  // namespace telesplat::lab
