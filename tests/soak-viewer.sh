#!/usr/bin/env bash
# Uses the window for a while as somebody in a hurry would: resizes, scene switches, settings, every few seconds, on a
# display without a screen. Fails if the program ends, panics, or reports a validation error; prints its memory.
#
#   tests/soak-viewer.sh [MINUTES] [PROGRAM]     60 minutes of target/release/sunfleck
set -euo pipefail
cd "$(dirname "$0")/.."
minutes="${1:-60}"
program="${2:-target/release/sunfleck}"
. tests/display.sh
need Xvfb xdotool
[[ -x "$program" ]] || { echo "soak-viewer: no $program: cargo build --release" >&2; exit 1; }

start_display 1920x1080
alive() { kill -0 "$viewer" 2>/dev/null; }
open --backend gpu

scenes=(cornell glass pool bathroom fireplace)
keys=(e shift+e x t space n f plus minus minus v shift+v g F1 F2 F3 F3 1 2 3 question Escape ctrl+z ctrl+y c)
title() { xdotool getwindowname "$window"; }
mib() { awk "/^$1:/ { print int(\$2 / 1024) }" "/proc/$viewer/status"; }
between() { echo $((RANDOM % ($2 - $1 + 1) + $1)); }
size() { xdotool windowsize "$window" "$1" "$2"; }
drag() { # with this button
    xdotool mousemove "$(between 300 900)" "$(between 150 500)" mousedown "$1"
    for _ in 1 2 3 4 5 6; do
        xdotool mousemove_relative -- "$(between -40 40)" "$(between -30 30)"
        sleep 0.05
    done
    xdotool mouseup "$1"
}
switch() { # to the scene of this number, on the start page as it is in a window of 1280 by 720
    local tries
    size 1280 720
    for tries in {1..30}; do
        xdotool windowfocus "$window" key Escape key ctrl+w
        sleep 1
        xdotool mousemove $((24 + 249 * $1 + 117)) 330 sleep 0.3 click 1
        for _ in {1..20}; do
            [[ "$(title)" == "${scenes[$1]} –"* ]] && return 0
            sleep 0.2
        done
        alive || return 1
    done
    return 1
}

began=$SECONDS loads=0 actions=0 most=0 failed=""
while ((SECONDS - began < 60 * minutes)) && alive; do
    scene=$((loads % ${#scenes[@]}))
    if ! switch "$scene"; then
        failed="${scenes[$scene]} does not open; the window is called $(title || true)"
        command -v import >/dev/null && import -window root soak-viewer-failed.png
        break
    fi
    loads=$((loads + 1))
    until_then=$((SECONDS + $(between 12 25)))
    while ((SECONDS < until_then)) && alive; do
        case $((RANDOM % 6)) in
            0) size "$(between 480 1900)" "$(between 320 1060)" ;;
            1) drag 1 ;;
            2) drag 3 ;;
            3) xdotool mousemove "$(between 300 900)" "$(between 150 500)" click "$(between 4 5)" ;;
            *) xdotool windowfocus "$window" key "${keys[RANDOM % ${#keys[@]}]}" ;;
        esac
        actions=$((actions + 1))
        sleep 0.$(between 2 9)
    done
    alive || break
    now="$(mib VmRSS)"
    ((now > most)) && most=$now
    echo "$((SECONDS - began)) s: ${scenes[$scene]}, $now MiB, $(mib RssAnon) not shared; $(title)"
done

status=0
if alive && [[ -z "$failed" ]]; then
    peak="$(mib VmHWM)"
    xdotool windowfocus "$window" key Escape key ctrl+q
    for _ in {1..300}; do alive || break; sleep 0.2; done
    if alive; then failed="does not quit"; else wait "$viewer" || failed="exit status $?"; fi
elif [[ -z "$failed" ]]; then
    failed="has ended"
fi
[[ -z "$failed" ]] || { echo "soak-viewer: $failed"; status=1; }
if grep -inE "panic|validation|error" "$work/stderr"; then status=1; fi
echo "$((SECONDS - began)) s, $loads scenes, $actions actions; memory: $most MiB at most after a scene, ${peak:-?} MiB at its peak"
exit $status
