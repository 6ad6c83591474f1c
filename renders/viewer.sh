#!/usr/bin/env bash
# Makes the pictures of the window again, from the real program on a display without a screen. About five minutes.
#
#   renders/viewer.sh [FOLDER]     into renders/ if none is given
#
# SUNFLECK names another program than target/release/sunfleck, which is built if it is not there.
set -euo pipefail
cd "$(dirname "$0")/.."
folder="${1:-renders}"

. tests/display.sh
need Xvfb xdotool import convert
program="${SUNFLECK:-target/release/sunfleck}"
[[ -x "$program" ]] || cargo build --release

start_display 1600x900
show() { # the program with these arguments, as large as the screen
    open "$@"
    xdotool windowmove "$window" 0 0 windowsize "$window" 1600 900 windowfocus "$window"
}
wait_for() { # until the window says that it has done so many iterations
    until [[ "$(xdotool getwindowname "$window")" == *"– $1 iterations –"* ]]; do
        kill -0 "$viewer" || { cat "$work/stderr" >&2; exit 1; }
        sleep 0.2
    done
}
keys() { for key in "$@"; do xdotool key "$key"; sleep 0.3; done; }
shot() { # a picture of the window, when nothing has changed for a second
    local before= now=
    xdotool mousemove 1599 899
    sleep 2
    until [[ -n "$before" && "$before" == "$now" ]]; do
        before="$now"
        sleep 1
        import -window root "$work/now.png"
        now="$(convert "$work/now.png" rgb:- | md5sum)"
    done
    local to="$folder/viewer-$1.png" colors
    convert "$work/now.png" -strip -define png:compression-level=9 "$to"
    for colors in 256 128 64; do
        (($(stat -c %s "$to") <= 400 * 1024)) && break
        convert "$work/now.png" -strip -dither FloydSteinberg -colors "$colors" -define png:compression-level=9 "$to"
    done
    echo "$to: $(($(stat -c %s "$to") / 1024)) KiB"
}
close() {
    keys ctrl+q
    wait "$viewer"
}

show
shot start
close

show glass --set size=960x540 --set photons=200k --iterations 300
wait_for 300
shot caustic
# Photons over the picture: by power, then by bounce.
keys g g
shot photons
keys g F3
shot convergence
close

# What few iterations have found beside what many have.
"$program" render glass --set size=960x540 --set photons=200k --iterations 300 -q -o "$work/reference.exr"
show glass --set size=960x540 --set photons=200k --iterations 4 --reference "$work/reference.exr"
wait_for 4
keys c
shot compare
close
