#!/bin/sh
# Writes the secrets of compose.yaml: sh deploy/compose/make_secrets.sh NAME [FOLDER]
#
# NAME is what callers call this machine by, a name or an address; the certificate for it signs itself, and callers are
# given it as --ca. FOLDER is `secrets` beside this script; what is there already is kept. What the server reads goes to
# FOLDER/server, the first caller's token to FOLDER/first_token. For envoy.yaml there are an authority of callers
# (FOLDER/callers/ca.crt, its key FOLDER/callers_ca.key) and the first caller's certificate (FOLDER/first_caller.crt and
# .key). Needs openssl; as root it also hands the files to the user of the containers.
set -eu
umask 077
name=${1:?"usage: make_secrets.sh NAME [FOLDER]"}
folder=${2:-$(dirname "$0")/secrets}
user=10001
case $name in
    '' | *[!A-Za-z0-9.:_-]*)
        echo "make_secrets.sh: '$name' is not a name or address of a machine" >&2
        exit 2
        ;;
esac
mkdir -p "$folder/server" "$folder/callers"
cd "$folder"

if [ ! -e server/tls_key ]; then
    case $name in
        *[!0-9.]*) kind=DNS ;;
        *) kind=IP ;;
    esac
    case $name in
        *:*) kind=IP ;;
    esac
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 365 -subj "/CN=robosc" \
        -addext "subjectAltName=$kind:$name" -keyout server/tls_key -out server/tls_certificate 2>/dev/null
fi
if [ ! -e server/tokens ]; then
    # The token has the form of those of `robosc-server token`.
    token=robosc_$(openssl rand -base64 32 | tr '+/' '-_' | tr -d '=')
    digest=$(printf '%s' "$token" | openssl dgst -sha256 -r | cut -d ' ' -f 1)
    printf '%s\n' "$token" > first_token
    printf 'first synthesize,admin sha256:%s\n' "$digest" > server/tokens
fi
if [ ! -e database_password ]; then
    openssl rand -hex 32 | tr -d '\n' > database_password
    # Host, port, database, user, password.
    printf 'database:5432:robosc:robosc:%s\n' "$(cat database_password)" > server/database_login
fi
if [ ! -e callers_ca.key ]; then
    openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 3650 -subj "/CN=callers of robosc" \
        -addext "keyUsage=critical,keyCertSign,cRLSign" -keyout callers_ca.key -out callers/ca.crt 2>/dev/null
    openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj "/CN=first" -keyout first_caller.key \
        -out first_caller.csr 2>/dev/null
    printf 'basicConstraints=critical,CA:FALSE\nextendedKeyUsage=clientAuth\n' > first_caller.ext
    openssl x509 -req -in first_caller.csr -CA callers/ca.crt -CAkey callers_ca.key -set_serial "0x$(openssl rand -hex 16)" \
        -days 365 -extfile first_caller.ext -out first_caller.crt 2>/dev/null
    rm first_caller.csr first_caller.ext
fi
if [ "$(id -u)" = 0 ]; then
    chown "$user:$user" callers callers/ca.crt
    chown "$user:$user" server server/tls_key server/tls_certificate server/tokens server/database_login database_password
else
    echo "make_secrets.sh: not root: hand them over with: sudo chown -R $user:$user $PWD/server $PWD/callers $PWD/database_password" >&2
fi
echo "written to $PWD; callers need server/tls_certificate (--ca) and first_token (--token-file)"
echo "through Envoy, first_caller.crt (--certificate) and first_caller.key (--key) take the place of the token"
