#!/usr/bin/env bash
# Renders the gallery again. About half an hour on two CPU cores.
set -euo pipefail
cd "$(dirname "$0")/.."
cargo build --release
render() { ./target/release/sunfleck render -r 960x540 --backend cpu "$@"; }
render scenes/glass/glass.toml -o renders/glass.png --iterations 200
render scenes/cornell/cornell.toml -o renders/cornell.png --iterations 120 -r 600x600
render scenes/pool/pool.toml -o renders/pool.png --iterations 96
render scenes/fireplace/fireplace.toml -o renders/fireplace.png --iterations 96
render scenes/bathroom/bathroom.toml -o renders/bathroom.png --iterations 64
# Of the viewer's start page; ImageMagick. What matters of the square picture is below its middle.
thumbnail() {
  convert "renders/$1.png" -resize 320x180^ -gravity center -extent "320x180+0+$2" -dither FloydSteinberg \
    -colors 256 -strip -define png:compression-level=9 "PNG8:src/bin/sunfleck/view/thumbnails/$1.png"
}
thumbnail cornell 54
for name in bathroom fireplace glass pool; do thumbnail "$name" 0; done
