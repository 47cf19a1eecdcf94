import "./catalogue";
import { Button, Checkbox, Group, NativeSelect, Skeleton, Stack, Text, Title } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { saveFile } from "../../lib/csv";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DataTable } from "../../ui/DataTable";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { RequirePermission } from "../auth/RequirePermission";
import {
  describeAcceptedValues,
  describeField,
  describeFieldUnit,
  describeValue,
  withMinus,
} from "./describeSetting";
import { ImportSettings } from "./ImportSettings";

type Version = Schemas["StationVersion"];

const useSettings = (station: string, number: number | undefined) =>
  useQuery({
    queryKey: ["station-settings", station, number],
    queryFn: () => api.stationSettings(station, number ?? 1),
    enabled: number !== undefined,
  });

const choice = ({ number, since }: Version) =>
  t("commissioning:settings.choice", { number, since: formatMoment(since) });

/**
 * Shows a version of the configuration with units, beside another version. It can be exported, and a file can
 * be imported.
 */
export function SettingsTab({ station, versions }: { station: string; versions: Version[] }) {
  const search = useSearch({ from: "/commissioning" });
  const navigate = useNavigate({ from: "/commissioning" });
  const newest = versions[0]?.number ?? 1;
  const number = search.version ?? newest;
  const settings = useSettings(station, number);
  const other = useSettings(station, search.other);
  const chosen = versions.find((version) => version.number === number);
  const show = (version: number, compared: number | undefined) =>
    void navigate({ search: { tab: "settings", version, ...(compared && { other: compared }) } });
  return (
    <Stack>
      <Group align="end">
        <NativeSelect
          size="md"
          label={t("commissioning:settings.version")}
          value={String(number)}
          onChange={(event) => show(Number(event.currentTarget.value), search.other)}
          data={versions.map((version) => ({ value: String(version.number), label: choice(version) }))}
        />
        <NativeSelect
          size="md"
          label={t("commissioning:settings.compare")}
          value={String(search.other ?? "")}
          onChange={(event) => show(number, Number(event.currentTarget.value) || undefined)}
          data={[
            { value: "", label: t("commissioning:settings.nothing") },
            ...versions.map((version) => ({ value: String(version.number), label: choice(version) })),
          ]}
        />
        {chosen && (
          <Button
            variant="default"
            size="md"
            leftSection={<IconDownload size={20} />}
            onClick={() => saveFile(`${station} ${number}.toml`, chosen.config, "application/toml")}
          >
            {t("commissioning:settings.export")}
          </Button>
        )}
      </Group>
      <ProblemNote error={settings.error ?? other.error} />
      {settings.isPending && <Skeleton h={320} />}
      {settings.data && <Fields settings={settings.data} other={search.other ? other.data : undefined} />}
      <RequirePermission permission="commission">
        <ImportSettings station={station} />
      </RequirePermission>
    </Stack>
  );
}

/** Shows every field. If another version is chosen, it also shows the value in that version. */
function Fields({ settings, other }: Compared) {
  const [onlyChanges, setOnlyChanges] = useState(true);
  const rows = comparedRows({ settings, other });
  const shown = other && onlyChanges ? rows.filter((row) => row.value !== row.before) : rows;
  // Without a comparison the motors are columns of one table, which shows how they differ.
  const motors = other ? [] : motorRows(shown);
  const listed = other ? shown : shown.filter((row) => !MOTOR.test(row.name));
  return (
    <Stack gap="xs">
      {other && (
        <Checkbox
          size="md"
          label={t("commissioning:settings.onlyChanges")}
          checked={onlyChanges}
          onChange={(event) => setOnlyChanges(event.currentTarget.checked)}
        />
      )}
      {shown.length === 0 ? (
        <Text>{t("commissioning:settings.noChanges")}</Text>
      ) : (
        <Stack gap="xl" data-testid="settings">
          <section aria-label={t("commissioning:settings.general")}>
            {!other && (
              <Title order={2} size="h4">
                {t("commissioning:settings.general")}
              </Title>
            )}
            <DataTable
              name="settings"
              label={t("commissioning:settings.caption", { number: settings.number })}
              columns={columnsOf(other?.number)}
              rows={listed}
              rowKey={({ name }) => name}
              dense
            />
          </section>
          {motors.length > 0 && (
            <section aria-label={t("commissioning:settings.motors")}>
              <Title order={2} size="h4">
                {t("commissioning:settings.motors")}
              </Title>
              <DataTable
                name="motors"
                label={t("commissioning:settings.motors")}
                columns={motorColumns(motors)}
                rows={motors}
                rowKey={({ field }) => field}
                dense
              />
            </section>
          )}
        </Stack>
      )}
    </Stack>
  );
}

type Row = ReturnType<typeof comparedRows>[number];

/** Return the columns of the fields. `other`: number of the other version. */
function columnsOf(other: number | undefined): Column<Row>[] {
  const before: Column<Row> = {
    key: "before",
    head: t("commissioning:settings.other", { number: other ?? 0 }),
    right: true,
    value: (row) => row.before,
    cell: (row) => <Value field={row.name} text={row.before} />,
  };
  return [
    {
      key: "field",
      head: t("commissioning:settings.field"),
      always: true,
      value: (row) => row.name,
      cell: (row) => (
        <>
          {describeField(row.name)} <FileText text={row.name} small />
        </>
      ),
    },
    {
      key: "value",
      head: t("commissioning:settings.value"),
      right: true,
      always: true,
      value: (row) => row.value,
      cell: (row) => (
        <Value field={row.name} text={row.value} bold={other !== undefined && row.value !== row.before} />
      ),
    },
    ...(other === undefined ? [] : [before]),
    {
      key: "unit",
      head: t("commissioning:settings.unit"),
      value: describeFieldUnit,
      cell: describeFieldUnit,
    },
    {
      key: "accepted",
      onWide: true,
      head: t("commissioning:settings.accepted"),
      value: (row) => describeAcceptedValues(row.accepted),
      cell: (row) => describeAcceptedValues(row.accepted),
    },
  ];
}

/** Characters of a text that has space in a narrow column. */
const LONG_TEXT = 12;

const MOTOR = /^axes\[(\d+)\]\.(.+)$/;

/** A field that each motor has, with its settings by motor number. */
type MotorRow = { field: string; settings: Map<number, Schemas["SettingField"]> };

/** Return the fields of the motors, in the order of the first motor that has them. */
export function motorRows(fields: Schemas["SettingField"][]): MotorRow[] {
  const rows = new Map<string, MotorRow["settings"]>();
  for (const setting of fields) {
    const [, motor = "", field = ""] = MOTOR.exec(setting.name) ?? [];
    if (motor) rows.set(field, (rows.get(field) ?? new Map()).set(Number(motor), setting));
  }
  return [...rows].map(([field, settings]) => ({ field, settings }));
}

/** Return the accepted values of a field if they are the same for every motor, else "". */
function sharedRange({ settings }: MotorRow): string {
  const ranges = new Set([...settings.values()].map(({ accepted }) => describeAcceptedValues(accepted)));
  return ranges.size === 1 ? ([...ranges][0] ?? "") : "";
}

function motorColumns(rows: MotorRow[]): Column<MotorRow>[] {
  const motors = [...new Set(rows.flatMap(({ settings }) => [...settings.keys()]))].sort((a, b) => a - b);
  const first = ({ settings }: MotorRow) => [...settings.values()][0];
  const unit = (row: MotorRow) => {
    const setting = first(row);
    return setting ? describeFieldUnit(setting) : "";
  };
  return [
    {
      key: "field",
      head: t("commissioning:settings.field"),
      always: true,
      value: (row) => row.field,
      cell: (row) => (
        <>
          {describeField(`axes.${row.field}`)} <FileText text={row.field} small />
        </>
      ),
    },
    ...motors.map(
      (motor): Column<MotorRow> => ({
        key: `motor${motor}`,
        head: t("station:angles.motor", { motor }),
        right: true,
        value: (row) => row.settings.get(motor)?.value ?? "",
        cell: (row) => <MotorValue row={row} motor={motor} />,
      }),
    ),
    { key: "unit", head: t("commissioning:settings.unit"), value: unit, cell: unit },
    {
      key: "accepted",
      onWide: true,
      head: t("commissioning:settings.accepted"),
      value: sharedRange,
      cell: sharedRange,
    },
  ];
}

/** Shows a motor's value, and below it the accepted values if they differ between the motors. */
function MotorValue({ row, motor }: { row: MotorRow; motor: number }) {
  const setting = row.settings.get(motor);
  const range = setting && !sharedRange(row) ? describeAcceptedValues(setting.accepted) : "";
  return (
    <>
      <FileText text={setting?.value ?? ""} />
      {range && (
        <Text size="xs" c="dimmed" aria-label={t("commissioning:settings.acceptedOf", { range })}>
          {range}
        </Text>
      )}
    </>
  );
}

/** Shows a value: a word in the user's language with the file's word beside it, as for the names of the fields. */
function Value({ field, text, bold = false }: { field: string; text: string; bold?: boolean }) {
  const words = describeValue(field, text);
  if (!words) return <FileText text={text} bold={bold} />;
  return (
    <>
      {words} <FileText text={text} bold={bold} small />
    </>
  );
}

/** Shows a name or a value as the station's file contains it, in any language, with a minus sign before a negative number. */
function FileText({ text, bold = false, small = false }: { text: string; bold?: boolean; small?: boolean }) {
  return (
    <Text
      component="code"
      ff="monospace"
      translate="no"
      {...(small ? { size: "xs", c: "dimmed" } : { size: "sm" })}
      {...(bold && { fw: 700 })}
      // Only a long text, such as the path of a port, breaks within a word.
      style={{ overflowWrap: text.length > LONG_TEXT ? "anywhere" : "normal" }}
    >
      {withMinus(text) || "–"}
    </Text>
  );
}

type Compared = { settings: Schemas["StationSettings"]; other: Schemas["StationSettings"] | undefined };

/** Return the fields of both versions. `before` is the value in the other version. */
export function comparedRows({ settings, other }: Compared) {
  const before = new Map(other?.fields.map((field) => [field.name, field]));
  const own = settings.fields.map((field) => ({ ...field, before: before.get(field.name)?.value ?? "" }));
  const names = new Set(own.map((field) => field.name));
  const gone = (other?.fields ?? []).filter((field) => !names.has(field.name));
  return [...own, ...gone.map((field) => ({ ...field, before: field.value, value: "" }))];
}

/** Shows who changed the configuration, and when. `more`: there are older versions that are not loaded. */
export function HistoryTab({ versions, more = false }: { versions: Version[]; more?: boolean }) {
  return (
    <div data-testid="history">
      <DataTable
        name="station-history"
        label={t("commissioning:page.history")}
        columns={HISTORY_COLUMNS}
        rows={versions}
        rowKey={({ number }) => String(number)}
        more={more}
      />
    </div>
  );
}

const changedBy = (version: Version) => version.changed_by || t("commissioning:history.file");

const HISTORY_COLUMNS: Column<Version>[] = [
  {
    key: "number",
    head: t("commissioning:history.number"),
    always: true,
    value: ({ number }) => number,
    cell: ({ number }) => number,
  },
  {
    key: "since",
    head: t("commissioning:history.since"),
    always: true,
    value: ({ since }) => since,
    cell: ({ since }) => formatMoment(since),
  },
  { key: "who", below: "since", head: t("commissioning:history.who"), value: changedBy, cell: changedBy },
  {
    key: "software",
    onWide: true,
    head: t("commissioning:history.software"),
    value: ({ software }) => software,
    cell: ({ software }) => software,
  },
  {
    key: "what",
    head: t("commissioning:history.what"),
    always: true,
    cell: ({ number }) =>
      number > 1 ? (
        <ButtonLink
          to="/commissioning"
          search={{ tab: "settings", version: number, other: number - 1 }}
          variant="default"
          size="sm"
        >
          {t("commissioning:history.show")}
        </ButtonLink>
      ) : (
        t("commissioning:history.first")
      ),
  },
];
