import { Alert, Badge, Button, Card, Group, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { IconArchive } from "@tabler/icons-react";
import { type CSSProperties, type ReactNode, useState } from "react";
import { DataTable } from "../../ui/DataTable";
import { Metric, Metrics } from "../../ui/Metric";
import { PageTabs } from "../../ui/PageTabs";
import { TrendChart, TrendLegend } from "../../ui/TrendChart";
import type { Column } from "../../ui/tableRows";
import { undoStore } from "../../ui/undo";
import { COLOUR_ROLES, DENSITY, SPACES, TYPE_SCALE } from "./designLanguage";

const TRENDS = [
  { name: "First value", points: [9, 7, 6, 4].map((value, n) => ({ at: `2026-0${n + 5}-01`, value })) },
  { name: "Second value", points: [5, 5, 3, 2].map((value, n) => ({ at: `2026-0${n + 5}-01`, value })) },
];
type Row = { name: string; sessions: number };
const ROWS: Row[] = [
  { name: "Ito", sessions: 4 },
  { name: "Sato", sessions: 11 },
];
const COLUMNS: Column<Row>[] = [
  { key: "name", head: "Name", always: true, value: ({ name }) => name, cell: ({ name }) => name },
  {
    key: "sessions",
    head: "Sessions",
    right: true,
    total: true,
    value: ({ sessions }) => sessions,
    cell: ({ sessions }) => sessions,
  },
];
const TABS = { language: "Language", components: "Components", states: "States" };
const WORDS = {
  title: "Design language",
  spaces: "Spacing",
  type: "Type scale",
  colours: "Colour roles",
  density: "Density",
  numbers: "Numbers",
  trend: "Trend",
  buttons: "Buttons",
  table: "Table",
  empty: "Empty: one sentence that says what is missing and, where it helps, what to do.",
  loading: "Loading: a skeleton with the height of what comes.",
  error: "Error: the problem and the next step, where the content would be.",
  offer: "Yamada Hanako is archived.",
};

/** The design language and its components. This page exists only in `npm run dev`. */
export function DesignPage() {
  const [tab, setTab] = useState<keyof typeof TABS>("language");
  return (
    <Stack>
      <Title order={1} size="h2">
        {WORDS.title}
      </Title>
      <PageTabs label={WORDS.title} value={tab} names={TABS} onChange={setTab}>
        {(shown) =>
          shown === "language" ? <Language /> : shown === "components" ? <Components /> : <States />
        }
      </PageTabs>
    </Stack>
  );
}

function Language() {
  return (
    <Stack>
      <Rules title={WORDS.spaces} rules={SPACES}>
        {(value) => (
          <div
            style={{ width: `var(--mantine-spacing-${value})`, height: 20, background: "var(--kata-brand)" }}
          />
        )}
      </Rules>
      <Rules title={WORDS.type} rules={TYPE_SCALE}>
        {(value) => <span style={fontOf(value)}>{WORDS.title}</span>}
      </Rules>
      <Rules title={WORDS.colours} rules={COLOUR_ROLES}>
        {(value) => (
          <div style={{ width: 64, height: 32, border: "1px solid", background: `var(${value})` }} />
        )}
      </Rules>
      <Rules title={WORDS.density} rules={DENSITY} />
    </Stack>
  );
}

/** Return the style of a font such as "700 1.5rem/1.3". */
function fontOf(value: string): CSSProperties {
  const [fontWeight, fontSize, lineHeight] = value.split(/[ /]/);
  return { fontWeight, fontSize, lineHeight };
}

/** Lists rules with their values. `children` returns a sample of a value. Three columns would not fit a telephone. */
function Rules(props: {
  title: string;
  rules: readonly { value: string; use: string }[];
  children?: (value: string) => ReactNode;
}) {
  const sample = props.children;
  return (
    <Card withBorder>
      <Title order={2} size="h3">
        {props.title}
      </Title>
      <Table aria-label={props.title}>
        <Table.Tbody>
          {props.rules.map(({ value, use }) => (
            <Table.Tr key={value}>
              {sample && <Table.Td>{sample(value)}</Table.Td>}
              <Table.Td>
                <Text fw={600}>{value}</Text>
                {use}
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Card>
  );
}

function Components() {
  return (
    <Stack>
      <Metrics label={WORDS.numbers}>
        <Metric label="Flexion, active" value="120°" note="+15°" />
        <Metric label="Pain, 0 to 10" value="3" unit="of 10" note="unchanged" />
      </Metrics>
      <Card withBorder>
        <Title order={2} size="h4">
          {WORDS.trend}
        </Title>
        <TrendChart label={WORDS.trend} trends={TRENDS} max={10} step={5} />
        <TrendLegend trends={TRENDS} />
      </Card>
      <Group>
        <Button>{WORDS.buttons}</Button>
        <Button variant="default">{WORDS.buttons}</Button>
        <Button variant="subtle">{WORDS.buttons}</Button>
        <Badge size="lg" variant="light" tt="none">
          {WORDS.buttons}
        </Badge>
        <Button
          variant="default"
          leftSection={<IconArchive size={20} />}
          onClick={() => undoStore.offer({ words: WORDS.offer, undo: () => Promise.resolve() })}
        >
          {WORDS.offer}
        </Button>
      </Group>
      <DataTable
        name="design"
        label={WORDS.table}
        columns={COLUMNS}
        rows={ROWS}
        rowKey={({ name }) => name}
        rowName={({ name }) => name}
      />
    </Stack>
  );
}

function States() {
  return (
    <Stack>
      <Text>{WORDS.empty}</Text>
      <Text>{WORDS.loading}</Text>
      <Skeleton h={120} />
      <Alert color="grape" variant="light" role="alert">
        {WORDS.error}
      </Alert>
    </Stack>
  );
}
