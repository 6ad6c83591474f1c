# Sourced by scripts that use the window: a display without a screen, a folder $work, and an end that leaves nothing
# behind. Pids of what else is to end go into $pids.
#
#   start_display WIDTHxHEIGHT

start_display() {
    work="$(mktemp -d)"
    pids=()
    trap end EXIT
    Xvfb -displayfd 3 -screen 0 "$1x24" -nolisten tcp 3>"$work/display" 2>/dev/null &
    pids+=($!)
    until [[ -s "$work/display" ]]; do
        kill -0 "${pids[0]}" || { echo "Xvfb does not start" >&2; exit 1; }
        sleep 0.1
    done
    DISPLAY=":$(<"$work/display")"
    export DISPLAY XDG_DATA_HOME="$work" XDG_CONFIG_HOME="$work"
    unset WAYLAND_DISPLAY
}

end() {
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait 2>/dev/null || true
    rm -rf "$work"
}

need() { # these programs
    local tool missing=()
    for tool in "$@"; do command -v "$tool" >/dev/null || missing+=("$tool"); done
    ((${#missing[@]} == 0)) || { echo "$0: missing: ${missing[*]} (Debian: xvfb xdotool imagemagick)" >&2; exit 1; }
}

open() { # $program with these arguments; its window is $window, it is $viewer, and says $work/stderr
    "$program" view "$@" 2>"$work/stderr" &
    viewer=$!
    pids+=("$viewer")
    until window="$(xdotool search --onlyvisible --name Sunfleck 2>/dev/null | tail -n 1)" && [[ -n "$window" ]]; do
        kill -0 "$viewer" || { cat "$work/stderr" >&2; exit 1; }
        sleep 0.2
    done
}
