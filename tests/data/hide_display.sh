# Hide the libraries of a display, then run the command.
for name in libGL.so.1 libX11.so.6; do
  for file in $(PATH="$PATH:/usr/sbin:/sbin" ldconfig -p | sed -n "s/.*$name .* => //p"); do
    mount --bind /dev/null "$(readlink -f "$file")"
  done
done
exec "$@"
