"""Accounts, sign-ins, audit, restricted records, backups, and what stations run with

Revision ID: 0007
Revises: 0006
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

# These triggers prevent mistakes. A user who may change the schema can drop them; the chain and its anchor reveal that. On SQLite, INSERT OR
# REPLACE would silently replace a row if the trigger did not check its number.
ONLY_GROWS = {
    "sqlite": (
        """CREATE TRIGGER audit_grows BEFORE INSERT ON audit
        WHEN NEW.number IS NOT (SELECT coalesce(max(number), 0) + 1 FROM audit)
        BEGIN SELECT RAISE(ABORT, 'the audit trail is only added to, at its end'); END""",
        """CREATE TRIGGER audit_kept_as_it_is BEFORE UPDATE ON audit
        BEGIN SELECT RAISE(ABORT, 'the audit trail is only added to'); END""",
        """CREATE TRIGGER audit_kept BEFORE DELETE ON audit
        BEGIN SELECT RAISE(ABORT, 'the audit trail is only added to'); END""",
    ),
    "postgresql": (
        """CREATE FUNCTION audit_kept() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN RAISE EXCEPTION 'the audit trail is only added to'; END $$""",
        """CREATE FUNCTION audit_grows() RETURNS trigger LANGUAGE plpgsql AS $$
        BEGIN
            IF NEW.number IS DISTINCT FROM (SELECT coalesce(max(number), 0) + 1 FROM audit) THEN
                RAISE EXCEPTION 'the audit trail is only added to, at its end';
            END IF;
            RETURN NEW;
        END $$""",
        "CREATE TRIGGER audit_grows BEFORE INSERT ON audit FOR EACH ROW EXECUTE FUNCTION audit_grows()",
        "CREATE TRIGGER audit_kept BEFORE UPDATE OR DELETE ON audit FOR EACH ROW EXECUTE FUNCTION audit_kept()",
        "CREATE TRIGGER audit_kept_whole BEFORE TRUNCATE ON audit FOR EACH STATEMENT EXECUTE FUNCTION audit_kept()",
    ),
}

SEARCHED = ("account_id", "patient_id", "action", "outcome", "station")
STOPPED = {
    "ix_session_stops_code_therapist_started_at": ["code", "therapist", "started_at", "session_id", "station"],
    "ix_session_stops_code_station_started_at": ["code", "station", "started_at", "session_id"],
}
WHOSE = ("therapist", "station")


def upgrade() -> None:
    op.create_table(
        "accounts",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("username", sa.String(length=64), nullable=False),
        sa.Column("name", sa.String(length=100), nullable=False),
        sa.Column("role", sa.String(length=16), nullable=False),
        sa.Column("language", sa.String(length=8), nullable=False),
        sa.Column("password_hash", sa.String(length=200), nullable=True),
        sa.Column("password_changed_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("totp_sealed", sa.String(length=160), nullable=True),
        sa.Column("totp_confirmed_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("totp_last_step", sa.BigInteger(), nullable=True),
        sa.Column("code_hash", sa.String(length=64), nullable=True),
        sa.Column("code_until", sa.DateTime(timezone=True), nullable=True),
        sa.Column("oidc_subject", sa.String(length=512), nullable=True),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("updated_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("disabled_at", sa.DateTime(timezone=True), nullable=True),
        sa.PrimaryKeyConstraint("id", name="pk_accounts"),
        sa.UniqueConstraint("oidc_subject", name="uq_accounts_oidc_subject"),
        sa.UniqueConstraint("username", name="uq_accounts_username"),
    )
    op.create_table(
        "audit",
        sa.Column("number", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("account_id", sa.Uuid(), nullable=True),
        sa.Column("who", sa.String(length=100), nullable=False),
        sa.Column("role", sa.String(length=16), nullable=False),
        sa.Column("sign_in_id", sa.Uuid(), nullable=True),
        sa.Column("address", sa.String(length=64), nullable=False),
        sa.Column("action", sa.String(length=64), nullable=False),
        sa.Column("outcome", sa.String(length=8), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=True),
        sa.Column("subject", sa.String(length=100), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("detail", sa.Text(), nullable=False),
        sa.Column("anchor", sa.String(length=32), nullable=False),
        sa.Column("anchored", sa.BigInteger(), nullable=False),
        sa.Column("hash", sa.LargeBinary(length=32), nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_audit"),
    )
    op.create_index("ix_audit_at", "audit", ["at", "number"], unique=False)
    for name in SEARCHED:
        op.create_index(f"ix_audit_{name}_at", "audit", [name, "at", "number"], unique=False)
    for statement in ONLY_GROWS[op.get_bind().dialect.name]:
        op.execute(statement)
    op.create_table(
        "backups",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("kind", sa.String(length=8), nullable=False),
        sa.Column("file", sa.String(length=300), nullable=False),
        sa.Column("bytes", sa.BigInteger(), nullable=False),
        sa.Column("problem", sa.Text(), nullable=False),
        sa.Column("tested_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("test_problem", sa.Text(), nullable=False),
        sa.Column("audit_rows", sa.BigInteger(), nullable=True),
        sa.Column("audit_problem", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_backups"),
    )
    op.create_index("ix_backups_at", "backups", ["at"], unique=False)
    op.create_table(
        "account_stations",
        sa.Column("account_id", sa.Uuid(), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], name="fk_account_stations_account_id_accounts"),
        sa.PrimaryKeyConstraint("account_id", "station", name="pk_account_stations"),
    )
    op.create_table(
        "broken_glass",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("account_id", sa.Uuid(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("until", sa.DateTime(timezone=True), nullable=False),
        sa.Column("reviewed_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("reviewed_by", sa.String(length=100), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], name="fk_broken_glass_account_id_accounts"),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_broken_glass_patient_id_patients"),
        sa.PrimaryKeyConstraint("id", name="pk_broken_glass"),
    )
    op.create_index("ix_broken_glass_account_id", "broken_glass", ["account_id"], unique=False)
    op.create_index("ix_broken_glass_patient_id", "broken_glass", ["patient_id"], unique=False)
    op.create_table(
        "care_team",
        sa.Column("patient_id", sa.Uuid(), nullable=False),
        sa.Column("account_id", sa.Uuid(), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], name="fk_care_team_account_id_accounts"),
        sa.ForeignKeyConstraint(["patient_id"], ["patients.id"], name="fk_care_team_patient_id_patients"),
        sa.PrimaryKeyConstraint("patient_id", "account_id", name="pk_care_team"),
    )
    op.create_index("ix_care_team_account_id_patient_id", "care_team", ["account_id", "patient_id"], unique=False)
    op.create_table(
        "recovery_codes",
        sa.Column("account_id", sa.Uuid(), nullable=False),
        sa.Column("code_hash", sa.String(length=64), nullable=False),
        sa.Column("used_at", sa.DateTime(timezone=True), nullable=True),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], name="fk_recovery_codes_account_id_accounts"),
        sa.PrimaryKeyConstraint("account_id", "code_hash", name="pk_recovery_codes"),
    )
    op.create_table(
        "sign_ins",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("account_id", sa.Uuid(), nullable=False),
        sa.Column("secret_hash", sa.String(length=64), nullable=False),
        sa.Column("before_hash", sa.String(length=64), nullable=True),
        sa.Column("began_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("seen_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("proved_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("method", sa.String(length=16), nullable=False),
        sa.Column("address", sa.String(length=64), nullable=False),
        sa.Column("agent", sa.String(length=200), nullable=False),
        sa.Column("locked_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("ended_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("end_reason", sa.String(length=16), nullable=False),
        sa.ForeignKeyConstraint(["account_id"], ["accounts.id"], name="fk_sign_ins_account_id_accounts"),
        sa.PrimaryKeyConstraint("id", name="pk_sign_ins"),
        sa.UniqueConstraint("before_hash", name="uq_sign_ins_before_hash"),
        sa.UniqueConstraint("secret_hash", name="uq_sign_ins_secret_hash"),
    )
    op.create_index("ix_sign_ins_account_id", "sign_ins", ["account_id"], unique=False)
    schemas = op.create_table(
        "schemas",
        sa.Column("revision", sa.String(length=32), nullable=False),
        sa.Column("oldest", sa.String(length=32), nullable=False),
        sa.PrimaryKeyConstraint("revision", name="pk_schemas"),
    )
    op.bulk_insert(schemas, [{"revision": revision, "oldest": "0007"}])
    op.create_table(
        "spools",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("taken", sa.BigInteger(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_spools"),
    )
    op.create_table(
        "station_versions",
        sa.Column("station", sa.String(length=100), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("config", sa.Text(), nullable=False),
        sa.Column("software", sa.String(length=32), nullable=False),
        sa.Column("since", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["station"], ["stations.name"], name="fk_station_versions_station_stations"),
        sa.PrimaryKeyConstraint("station", "number", name="pk_station_versions"),
    )
    op.add_column("patients", sa.Column("restricted", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.create_index(
        "ix_patients_restricted",
        "patients",
        ["id"],
        unique=False,
        sqlite_where=sa.text("restricted = 1"),
        postgresql_where=sa.text("restricted"),
    )
    for name in WHOSE:
        op.add_column("session_stops", sa.Column(name, sa.String(length=100), nullable=False, server_default=""))
    op.execute(
        "UPDATE session_stops SET (therapist, station) ="
        " (SELECT therapist, station FROM sessions WHERE sessions.id = session_stops.session_id)"
    )
    for name, columns in STOPPED.items():
        op.create_index(name, "session_stops", columns, unique=False)


def downgrade() -> None:
    for name in STOPPED:
        op.drop_index(name, table_name="session_stops")
    for name in WHOSE:
        op.drop_column("session_stops", name)
    op.drop_index("ix_patients_restricted", table_name="patients")
    op.drop_column("patients", "restricted")
    op.drop_table("spools")
    op.drop_table("schemas")
    op.drop_table("station_versions")
    op.drop_index("ix_sign_ins_account_id", table_name="sign_ins")
    op.drop_table("sign_ins")
    op.drop_table("recovery_codes")
    op.drop_index("ix_care_team_account_id_patient_id", table_name="care_team")
    op.drop_table("care_team")
    op.drop_index("ix_broken_glass_patient_id", table_name="broken_glass")
    op.drop_index("ix_broken_glass_account_id", table_name="broken_glass")
    op.drop_table("broken_glass")
    op.drop_table("account_stations")
    op.drop_index("ix_backups_at", table_name="backups")
    op.drop_table("backups")
    for name in SEARCHED:
        op.drop_index(f"ix_audit_{name}_at", table_name="audit")
    op.drop_index("ix_audit_at", table_name="audit")
    op.drop_table("audit")
    if op.get_bind().dialect.name == "postgresql":
        op.execute("DROP FUNCTION audit_kept")
        op.execute("DROP FUNCTION audit_grows")
    op.drop_table("accounts")
