"""MAVLink 2 signing: the operator's keys, which frames they prove, and what is signed with them.

`trust.SigningRegistry` is the entry: the fleet asks it for a gate per system, the uplink has it sign, the station ticks
it. `keystore.KeyStore` holds keys on disk (also for `tui-gcs keys`), `timestamp_store` what a restart must remember
against replays, `key_derivation` the passphrase rules of other ground stations, `private_files` file access. A keyed
vehicle is never believed unsigned, and no secret appears in a text. The signatures themselves are computed in
core/mavlink/signing. Rules and threats: docs/threats.md A, B.6-27…37.
"""
