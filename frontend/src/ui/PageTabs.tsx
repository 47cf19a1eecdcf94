import { Tabs } from "@mantine/core";
import { type ReactNode, useEffect, useRef } from "react";
import classes from "./ui.module.css";

/**
 * The tabs of a page. Only the open tab is mounted. The address should contain `value`. `actions` are beside the
 * tabs, or above them where there is no space.
 */
export function PageTabs<Name extends string>(props: {
  label: string;
  value: Name;
  names: Record<Name, string>;
  onChange: (value: Name) => void;
  children: (value: Name) => ReactNode;
  actions?: ReactNode;
}) {
  const list = useRef<HTMLDivElement>(null);
  const place = Object.keys(props.names).indexOf(props.value);
  // On a telephone the open tab may be beyond the side of the screen, also after it is turned.
  useEffect(() => {
    const showOpenTab = () => {
      const tabs = list.current;
      const open = tabs?.children[place];
      if (tabs && open instanceof HTMLElement)
        tabs.scrollLeft = open.offsetLeft - (tabs.clientWidth - open.clientWidth) / 2;
    };
    showOpenTab();
    window.addEventListener("resize", showOpenTab);
    return () => window.removeEventListener("resize", showOpenTab);
  }, [place]);
  return (
    <Tabs value={props.value} onChange={(value) => value && props.onChange(value as Name)}>
      <div className={classes.tabRow}>
        <Tabs.List ref={list} aria-label={props.label} className={classes.tabs ?? ""}>
          {(Object.entries(props.names) as [Name, string][]).map(([name, label]) => (
            <Tabs.Tab key={name} value={name} h={44} fz="md">
              {label}
            </Tabs.Tab>
          ))}
        </Tabs.List>
        {props.actions && <div>{props.actions}</div>}
      </div>
      {(Object.keys(props.names) as Name[]).map((name) => (
        <Tabs.Panel key={name} value={name} pt="md">
          {name === props.value && props.children(name)}
        </Tabs.Panel>
      ))}
    </Tabs>
  );
}
